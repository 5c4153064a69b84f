/// Bytes as people write them.
#pragma once

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace crepes {

/// "55 a0" -> {0x55, 0xa0}.
inline std::vector<std::uint8_t> bytes_of(const std::string& hex) {
  std::istringstream in(hex);
  std::vector<std::uint8_t> bytes;
  for (unsigned value = 0; in >> std::hex >> value;) {
    bytes.push_back(static_cast<std::uint8_t>(value));
  }
  return bytes;
}

inline std::vector<std::uint8_t> operator+(std::vector<std::uint8_t> a,
                                           const std::vector<std::uint8_t>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace crepes
