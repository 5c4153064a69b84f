/// CRC-32 as in Ethernet, zlib and MCAP (reflected polynomial 0xEDB88320).
#pragma once

#include <cstdint>
#include <span>

namespace crepes {

/// The checksum of the bytes; of all bytes so far, if `before` is that of those before them.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t before = 0);

}  // namespace crepes
