#include "daemon/service/process_load.hpp"

#include <unistd.h>

#include <ctime>
#include <fstream>
#include <limits>

namespace crepes {

double process_cpu_s() {
  timespec used{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

double process_rss_mb() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0.0;
  double resident_pages = 0.0;
  if (!(statm >> total_pages >> resident_pages)) return std::numeric_limits<double>::quiet_NaN();
  return resident_pages * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace crepes
