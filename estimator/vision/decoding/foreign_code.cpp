#include "estimator/vision/decoding/foreign_code.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace crepes {
namespace {

/// Where an observation lies: its slot, and how far into it, as a part of the slot.
struct SlotTime {
  std::size_t slot;
  double into;
};

/// The pattern that the observations fit best if its slots begin at `shift` [slots].
class SlotPattern {
 public:
  SlotPattern(const BlinkWindow& window, const CodeModel& code, double shift)
      : code_(code), shift_(shift), blur_(code.edge_blur * static_cast<double>(code.slots)) {
    std::array<int, BlinkCode::kMaxSlots> more_lit{};
    for (std::size_t i = 0; i < window.size(); ++i) {
      const SlotTime at = slot_time(window[i].stamp);
      if (at.into < blur_ || at.into > 1.0 - blur_) continue;
      more_lit[at.slot] += window[i].lit ? 1 : -1;
    }
    for (std::size_t s = 0; s < code.slots; ++s) lit_[s] = more_lit[s] >= 0 ? 1.0 : 0.0;
  }

  [[nodiscard]] double log_likelihood(const BlinkWindow& window) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < window.size(); ++i) {
      const double p = code_.flip_rate + (1.0 - 2.0 * code_.flip_rate) * lit_part(window[i].stamp);
      sum += std::log(window[i].lit ? p : 1.0 - p);
    }
    return sum;
  }

 private:
  [[nodiscard]] SlotTime slot_time(Timestamp stamp) const {
    const double position = code_.part_of_period(stamp) * static_cast<double>(code_.slots) + shift_;
    const double slot = std::floor(position);
    return {static_cast<std::size_t>(slot) % code_.slots, position - slot};
  }
  /// At an edge both states are possible.
  [[nodiscard]] double lit_part(Timestamp stamp) const {
    const SlotTime at = slot_time(stamp);
    const double after = std::min((at.into + blur_) / (2.0 * blur_), 1.0);
    const double before = std::min((1.0 - at.into + blur_) / (2.0 * blur_), 1.0);
    return lit_[at.slot] * (after + before - 1.0) +
           lit_[(at.slot + code_.slots - 1) % code_.slots] * (1.0 - after) +
           lit_[(at.slot + 1) % code_.slots] * (1.0 - before);
  }

  const CodeModel& code_;
  double shift_;
  double blur_;  // at each end of a slot, as a part of it
  std::array<double, BlinkCode::kMaxSlots> lit_{};
};

}  // namespace

bool is_explained_better(const BlinkWindow& window, const CodeModel& code, std::size_t phase,
                         double nats) {
  if (code.slots == 0) return false;
  double ours = 0.0;
  for (std::size_t i = 0; i < window.size(); ++i) {
    const double p = code.lit_probability(phase, window[i].stamp);
    ours += std::log(window[i].lit ? p : 1.0 - p);
  }
  // No pattern explains more than every frame. This settles it for most boards in the clear.
  const double most = static_cast<double>(window.size()) * std::log(1.0 - code.flip_rate);
  if (most - ours <= nats) return false;
  const double step = static_cast<double>(code.slots) / static_cast<double>(code.phases);
  const double shift = step * static_cast<double>(phase);
  return std::ranges::any_of(std::array{shift, shift - step, shift + step}, [&](double begin) {
    const double from_slot = begin - std::floor(begin);
    return SlotPattern(window, code, from_slot).log_likelihood(window) - ours > nats;
  });
}

}  // namespace crepes
