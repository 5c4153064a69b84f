/// Which datagrams of a peer came, each once, though they overtake one another.
#pragma once

#include <cstdint>
#include <optional>

namespace crepes {

class SequenceWindow {
 public:
  enum class Verdict : std::uint8_t { kNew, kDuplicate, kTooOld };

  /// How far behind the newest a datagram may still be told from a duplicate.
  static constexpr std::uint32_t kSize = 64;

  [[nodiscard]] Verdict accept(std::uint32_t sequence);

  [[nodiscard]] std::uint64_t received() const { return received_; }
  /// Missing between the first and the newest; one that comes late is no longer lost.
  [[nodiscard]] std::uint64_t lost() const;

 private:
  std::optional<std::uint32_t> first_;
  std::uint32_t newest_ = 0;
  std::uint64_t seen_ = 0;  ///< bit i: newest_ - i came
  std::uint64_t received_ = 0;
};

}  // namespace crepes
