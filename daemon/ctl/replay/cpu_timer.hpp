/// Adds the processor's time of a scope to a total.
#pragma once

#include <ctime>

namespace crepes {

class CpuTimer {
 public:
  explicit CpuTimer(double& total_s) : total_s_(total_s), start_s_(now()) {}
  CpuTimer(const CpuTimer&) = delete;
  CpuTimer& operator=(const CpuTimer&) = delete;
  CpuTimer(CpuTimer&&) = delete;
  CpuTimer& operator=(CpuTimer&&) = delete;
  ~CpuTimer() { total_s_ += now() - start_s_; }

 private:
  static double now() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

  double& total_s_;
  double start_s_;
};

}  // namespace crepes
