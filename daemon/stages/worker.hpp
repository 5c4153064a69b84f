/// A thread with a name, joined by its destructor.
#pragma once

#include <pthread.h>

#include <concepts>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

namespace crepes {

/// Runs `loop(stop)` from construction until it returns. The destructor requests the stop and
/// joins: a loop must honor the request within 100 ms.
class Worker {
 public:
  /// `name` appears in top and gdb, cut to 15 characters.
  template <std::invocable<const std::stop_token&> Loop>
  Worker(const std::string& name, Loop loop)
      : thread_([short_name = name.substr(0, 15),
                 run = std::move(loop)](const std::stop_token& stop) mutable {
          ::pthread_setname_np(::pthread_self(), short_name.c_str());
          run(stop);
        }) {}

  /// Requests the stop without joining, so that several workers stop at the same time.
  void request_stop() { thread_.request_stop(); }

 private:
  std::jthread thread_;
};

}  // namespace crepes
