#include "net/mesh/sequence_window.hpp"

#include <algorithm>

namespace crepes {

SequenceWindow::Verdict SequenceWindow::judge(std::uint32_t sequence,
                                              std::uint32_t max_ahead) const {
  if (!first_) return Verdict::kNew;
  if (sequence > newest_)
    return sequence - newest_ > max_ahead ? Verdict::kTooFarAhead : Verdict::kNew;
  const std::uint32_t behind = newest_ - sequence;
  if (behind >= kSize) return Verdict::kTooOld;
  return (seen_ & std::uint64_t{1} << behind) != 0 ? Verdict::kDuplicate : Verdict::kNew;
}

SequenceWindow::Verdict SequenceWindow::accept(std::uint32_t sequence, std::uint32_t max_ahead) {
  const Verdict verdict = judge(sequence, max_ahead);
  if (verdict != Verdict::kNew) return verdict;
  if (!first_) first_ = newest_ = sequence;
  if (sequence > newest_) {
    const std::uint32_t ahead = sequence - newest_;
    seen_ = ahead < kSize ? seen_ << ahead : 0;
    newest_ = sequence;
  }
  seen_ |= std::uint64_t{1} << (newest_ - sequence);
  first_ = std::min(*first_, sequence);
  ++received_;
  return Verdict::kNew;
}

std::uint64_t SequenceWindow::lost() const {
  return first_ ? std::uint64_t{newest_} - *first_ + 1 - received_ : 0;
}

}  // namespace crepes
