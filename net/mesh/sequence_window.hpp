/// Replay window over the sequence numbers of a peer; datagrams may arrive out of order.
#pragma once

#include <cstdint>
#include <optional>

namespace crepes {

class SequenceWindow {
 public:
  /// The result for a sequence number.
  enum class Verdict : std::uint8_t { kNew, kDuplicate, kTooOld, kTooFarAhead };

  /// How far behind the newest a datagram can be and still be checked for duplicates.
  static constexpr std::uint32_t kSize = 64;

  /// `max_ahead` bounds a jump forward: one forged number must not make all true ones too old.
  [[nodiscard]] Verdict accept(std::uint32_t sequence, std::uint32_t max_ahead);
  /// What `accept` would return. Changes nothing.
  [[nodiscard]] Verdict judge(std::uint32_t sequence, std::uint32_t max_ahead) const;

  [[nodiscard]] std::uint64_t received() const { return received_; }
  /// The number of datagrams missing between the first and the newest. Late arrivals are
  /// subtracted.
  [[nodiscard]] std::uint64_t lost() const;

 private:
  std::optional<std::uint32_t> first_;
  std::uint32_t newest_ = 0;
  std::uint64_t seen_ = 0;  ///< bit i: newest_ - i was received
  std::uint64_t received_ = 0;
};

}  // namespace crepes
