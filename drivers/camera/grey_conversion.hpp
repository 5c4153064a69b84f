/// Conversion of grey levels to 8 bits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace crepes {

/// Writes the upper 8 of the `bits` significant bits of each little-endian 16-bit level to `grey`,
/// row by row without padding. `rows` must hold `height` rows of `stride` bytes; the last row needs
/// no padding.
inline void narrow_to_8_bits(std::span<const std::uint8_t> rows, int width, int height,
                             std::size_t stride, int bits, std::vector<std::uint8_t>& grey) {
  const auto columns = static_cast<std::size_t>(width);
  grey.resize(columns * static_cast<std::size_t>(height));
  const int shift = bits - 8;
  const int white = (1 << bits) - 1;
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const std::uint8_t* in = &rows[y * stride];
    std::uint8_t* out = &grey[y * columns];
    for (std::size_t x = 0; x < columns; ++x) {
      const int level = in[2 * x] | in[2 * x + 1] << 8;
      // A level above white has noise in bits that should be zero.
      out[x] = static_cast<std::uint8_t>((level < white ? level : white) >> shift);
    }
  }
}

/// Writes the upper 8 bits of each level of rows in MIPI CSI-2's packing to `grey`, without
/// padding: of `group` pixels, first their upper bytes, then one byte with all lower bits. `rows`
/// as above.
inline void unpack_upper_bytes(std::span<const std::uint8_t> rows, int width, int height,
                               std::size_t stride, std::size_t group,
                               std::vector<std::uint8_t>& grey) {
  const auto columns = static_cast<std::size_t>(width);
  grey.resize(columns * static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const std::uint8_t* in = &rows[y * stride];
    std::uint8_t* out = &grey[y * columns];
    for (std::size_t x = 0; x < columns; ++x) out[x] = in[x + x / group];
  }
}

}  // namespace crepes
