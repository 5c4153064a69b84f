/// The datagrams that a robot sent in the last seconds: what peers may echo, and what may come
/// back.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

#include "net/mesh/peer_message.hpp"

namespace crepes {

class SentLog {
 public:
  static constexpr Duration kMemory = std::chrono::seconds{10};

  /// A datagram leaves at `at`.
  void add(Timestamp at, std::uint32_t sequence, bool is_marked) {
    sent_.push_back({at, sequence, is_marked});
    while (sent_.front().at <= at - kMemory) sent_.pop_front();
  }

  /// When the latest datagram was sent.
  [[nodiscard]] std::optional<Timestamp> last() const {
    return sent_.empty() ? std::nullopt : std::optional(sent_.back().at);
  }

  /// When the datagram that an echo names was sent, if that was a moment ago.
  [[nodiscard]] std::optional<Timestamp> find(std::uint32_t code, Timestamp now) const {
    const auto found = std::find_if(sent_.rbegin(), sent_.rend(), [code](const Sent& sent) {
      return echo_code(to_ns(sent.at)) == code;
    });
    const bool is_known = found != sent_.rend() && found->at > now - kMemory;
    return is_known ? std::optional(found->at) : std::nullopt;
  }

  /// Whether a recent datagram with this number was marked to be forwarded.
  [[nodiscard]] bool is_marked(std::uint32_t sequence) const {
    return std::ranges::any_of(
        sent_, [&](const Sent& sent) { return sent.sequence == sequence && sent.is_marked; });
  }

 private:
  struct Sent {
    Timestamp at{};
    std::uint32_t sequence = 0;
    bool is_marked = false;
  };
  std::deque<Sent> sent_;
};

}  // namespace crepes
