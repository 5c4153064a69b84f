/// The progress of a command as one line of text. Pure.
#pragma once

#include <string>

#include "estimator/core/time.hpp"

namespace crepes {

class ProgressBar {
 public:
  explicit ProgressBar(Timestamp start) : start_(start) {}

  /// A bar, the share that is done (0 to 1) and, after the first second, the time left if the rest
  /// takes as long as what is done did. Less than 80 columns.
  [[nodiscard]] std::string text(double share, Timestamp now) const;

 private:
  Timestamp start_;
};

/// For example "45 s", "3 min 5 s", "2 h 10 min".
[[nodiscard]] std::string rough_time(double seconds);

}  // namespace crepes
