/// The share of a peer's datagrams that do not arrive. Pure.
#pragma once

#include <cstdint>
#include <optional>

namespace crepes {

class LossMeter {
 public:
  /// A datagram arrived; until now `missing` datagrams of the session have not.
  void update(std::uint64_t missing);
  /// The same for a peer that is not heard directly. One in `spacing` of its datagrams is
  /// forwarded; this one has the number `sequence`.
  void update_forwarded(std::uint64_t missing, std::uint32_t sequence, std::uint32_t spacing);

  /// Of the recent datagrams that should have arrived.
  [[nodiscard]] double share() const { return share_; }
  /// Since the start.
  [[nodiscard]] std::uint64_t lost() const {
    return lost_ > 0 ? static_cast<std::uint64_t>(lost_) : 0;
  }

 private:
  void add(std::int64_t lost);

  double share_ = 0.0;
  double received_weight_ = 0.0;
  double lost_weight_ = 0.0;
  std::int64_t lost_ = 0;
  std::uint64_t missing_ = 0;
  std::optional<std::uint32_t> last_forwarded_;
};

}  // namespace crepes
