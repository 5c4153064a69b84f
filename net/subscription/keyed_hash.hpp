/// A short hash that cannot be predicted or inverted without its key. Pure.
#pragma once

#include <array>
#include <cstdint>

#include "net/endpoint.hpp"

namespace crepes {

/// Random, generated at start and kept secret.
using HashKey = std::array<std::uint8_t, 16>;

/// SipHash-2-4 of an address, its port and a number.
[[nodiscard]] std::uint64_t keyed_hash(const HashKey& key, const Endpoint& endpoint,
                                       std::uint64_t number);

}  // namespace crepes
