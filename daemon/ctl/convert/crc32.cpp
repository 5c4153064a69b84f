#include "daemon/ctl/convert/crc32.hpp"

#include <array>

namespace crepes {
namespace {

/// The remainders of all bytes.
constexpr std::array<std::uint32_t, 256> remainders() {
  constexpr std::uint32_t kPolynomial = 0xEDB88320U;
  std::array<std::uint32_t, 256> table{};
  for (std::uint32_t byte = 0; byte < table.size(); ++byte) {
    std::uint32_t rest = byte;
    for (int bit = 0; bit < 8; ++bit) rest = (rest >> 1U) ^ ((rest & 1U) != 0 ? kPolynomial : 0U);
    table.at(byte) = rest;
  }
  return table;
}

constexpr std::array<std::uint32_t, 256> kRemainders = remainders();

}  // namespace

void Crc32::add(std::string_view bytes) {
  for (const char c : bytes) {
    const std::uint32_t index = (state_ ^ static_cast<unsigned char>(c)) & 0xFFU;
    state_ = kRemainders[index] ^ (state_ >> 8U);
  }
}

}  // namespace crepes
