/// CRC-32 as in Ethernet and zlib (reflected polynomial 0xEDB88320).
#pragma once

#include <cstdint>
#include <span>

namespace crepes {

/// The checksum of the bytes.
[[nodiscard]] std::uint32_t crc32(std::span<const std::uint8_t> bytes);

}  // namespace crepes
