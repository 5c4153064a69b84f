/// From a report to the integers of a datagram's body: what can be sent, rounded.
#pragma once

#include <cstddef>
#include <cstdint>

#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_code.hpp"

namespace crepes::wire {

/// Counts the datagrams of this kind. Those that are forwarded have turns of their own.
[[nodiscard]] inline std::uint32_t turn_of(const OutgoingPeerMessage& message) {
  return message.mark > 0 ? message.sequence / message.mark : message.sequence;
}

/// What `quantized` returns.
struct QuantizedMessage {
  CodedBody body;           ///< all that a datagram might carry
  std::size_t refused = 0;  ///< measurements that are not finite or cannot be encoded
};

/// The message in integers, with as many copies as the limits say, whether they fit or not.
[[nodiscard]] QuantizedMessage quantized(const OutgoingPeerMessage& message,
                                         const WireLimits& limits);

}  // namespace crepes::wire
