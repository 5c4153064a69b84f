/// When each board began its code last: the phase in which a board that is out of sight returns.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"

namespace crepes {

/// The last known phase of each board, by index into the library. A board that is out of sight
/// keeps blinking, and its phase can be predicted: two crystals differ by at most 200 ppm.
class PhaseMemory {
 public:
  /// When a code began last, and when that was known.
  struct Phase {
    std::size_t phase = 0;
    Timestamp learned{};
  };

  void update(const CodeMatch& match, Timestamp now);
  [[nodiscard]] std::optional<Phase> of(std::size_t code) const {
    return code < phases_.size() ? phases_[code] : std::nullopt;
  }
  [[nodiscard]] std::size_t size() const { return known_; }

 private:
  std::vector<std::optional<Phase>> phases_;
  std::size_t known_ = 0;
};

}  // namespace crepes
