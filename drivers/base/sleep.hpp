/// Sleeping.
#pragma once

#include <algorithm>
#include <ctime>

#include "estimator/core/time.hpp"

namespace crepes {

/// Blocks the calling thread for `duration`, less if a signal arrives; not at all if negative.
inline void sleep_for(Duration duration) {
  constexpr Duration kSecond = std::chrono::seconds(1);
  duration = std::max(duration, Duration::zero());
  const timespec wait{.tv_sec = duration / kSecond, .tv_nsec = (duration % kSecond).count()};
  ::nanosleep(&wait, nullptr);
}

}  // namespace crepes
