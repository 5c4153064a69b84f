#include "net/mesh/loss_meter.hpp"

#include <algorithm>
#include <utility>

namespace crepes {

void LossMeter::update(std::uint64_t missing) {
  last_forwarded_.reset();
  const std::uint64_t before = std::exchange(missing_, missing);
  add(static_cast<std::int64_t>(missing) - static_cast<std::int64_t>(before));
}

void LossMeter::update_forwarded(std::uint64_t missing, std::uint32_t sequence,
                                 std::uint32_t spacing) {
  missing_ = missing;
  const std::uint32_t before = last_forwarded_.value_or(sequence);
  last_forwarded_ = std::max(before, sequence);
  const auto ahead = (std::int64_t{sequence} - std::int64_t{before}) / spacing;
  add(ahead > 0 ? ahead - 1 : ahead < 0 ? -1 : 0);  // one that arrives late was counted as lost
}

void LossMeter::add(std::int64_t lost) {
  constexpr double kMemory = 0.98;      // two seconds of 25 datagrams each
  constexpr double kLongestGap = 50.0;  // so that a long absence is soon forgotten
  lost_ += lost;
  received_weight_ = kMemory * received_weight_ + 1;
  // One that arrives late is no longer lost.
  const double gap = std::min(static_cast<double>(lost), kLongestGap);
  lost_weight_ = std::max(0.0, kMemory * lost_weight_ + gap);
  share_ = lost_weight_ / (lost_weight_ + received_weight_);
}

}  // namespace crepes
