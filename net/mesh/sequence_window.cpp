#include "net/mesh/sequence_window.hpp"

#include <algorithm>

namespace crepes {

SequenceWindow::Verdict SequenceWindow::accept(std::uint32_t sequence, std::uint32_t max_ahead) {
  if (!first_) {
    first_ = newest_ = sequence;
  } else if (sequence > newest_) {
    const std::uint32_t ahead = sequence - newest_;
    if (ahead > max_ahead) return Verdict::kTooFarAhead;
    seen_ = ahead < kSize ? seen_ << ahead : 0;
    newest_ = sequence;
  }
  const std::uint32_t behind = newest_ - sequence;
  if (behind >= kSize) return Verdict::kTooOld;
  const std::uint64_t bit = std::uint64_t{1} << behind;
  if ((seen_ & bit) != 0) return Verdict::kDuplicate;

  seen_ |= bit;
  first_ = std::min(*first_, sequence);
  ++received_;
  return Verdict::kNew;
}

std::uint64_t SequenceWindow::lost() const {
  return first_ ? std::uint64_t{newest_} - *first_ + 1 - received_ : 0;
}

}  // namespace crepes
