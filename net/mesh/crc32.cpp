#include "net/mesh/crc32.hpp"

#include <array>

namespace crepes {
namespace {

constexpr std::array<std::uint32_t, 256> make_table() {
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    std::uint32_t remainder = i;
    for (int bit = 0; bit < 8; ++bit)
      remainder = (remainder >> 1U) ^ ((remainder & 1U) != 0 ? 0xEDB88320U : 0U);
    table[i] = remainder;
  }
  return table;
}

constexpr auto kTable = make_table();

}  // namespace

std::uint32_t crc32(std::span<const std::uint8_t> bytes, std::uint32_t before) {
  std::uint32_t remainder = ~before;
  for (const std::uint8_t byte : bytes)
    remainder = (remainder >> 8U) ^ kTable[(remainder ^ byte) & 0xFFU];
  return ~remainder;
}

}  // namespace crepes
