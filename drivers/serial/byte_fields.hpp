/// Reads numbers from frames. The caller has checked the length.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <type_traits>

#include "drivers/serial/frame_decoder.hpp"

namespace crepes {

/// An unsigned number of `count` bytes.
[[nodiscard]] inline std::uint64_t unsigned_at(Bytes bytes, std::size_t at, std::size_t count,
                                               std::endian order = std::endian::little) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t next = order == std::endian::big ? i : count - 1 - i;
    value = value << 8U | bytes[at + next];
  }
  return value;
}

/// A number with the object representation of T, in the given byte order.
template <class T>
[[nodiscard]] T field_at(Bytes bytes, std::size_t at, std::endian order = std::endian::little) {
  const std::uint64_t value = unsigned_at(bytes, at, sizeof(T), order);
  if constexpr (std::is_same_v<T, float>) {
    return std::bit_cast<float>(static_cast<std::uint32_t>(value));
  } else if constexpr (std::is_same_v<T, double>) {
    return std::bit_cast<double>(value);
  } else {
    return static_cast<T>(value);
  }
}

/// Three consecutive numbers.
template <class T>
[[nodiscard]] Eigen::Vector3d vector_at(Bytes bytes, std::size_t at,
                                        std::endian order = std::endian::little) {
  const auto field = [&](std::size_t i) {
    return static_cast<double>(field_at<T>(bytes, at + i * sizeof(T), order));
  };
  return {field(0), field(1), field(2)};
}

/// The low eight bits of the sum.
[[nodiscard]] inline std::uint8_t byte_sum(Bytes bytes) {
  return static_cast<std::uint8_t>(std::accumulate(bytes.begin(), bytes.end(), 0U));
}

/// CRC-16 with polynomial 0x1021, most significant bit first; `before` is that of the bytes before
/// them. Over bytes with their CRC it is 0.
[[nodiscard]] inline std::uint16_t crc16(Bytes bytes, std::uint16_t before = 0) {
  std::uint32_t crc = before;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<std::uint32_t>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000U) != 0 ? crc << 1U ^ 0x1021U : crc << 1U;
  }
  return static_cast<std::uint16_t>(crc);
}

/// Whether the first bytes of the frame occur in it again. A truncated frame and the next one can
/// together have a valid checksum (one in 256), which would yield a wrong value.
[[nodiscard]] inline bool begins_twice(Bytes frame) {
  constexpr std::size_t kBeginning = 4;
  for (std::size_t at = 1; at + 1 < frame.size(); ++at) {
    const Bytes rest = frame.subspan(at, std::min(kBeginning, frame.size() - at));
    if (std::ranges::equal(rest, frame.first(rest.size()))) return true;
  }
  return false;
}

}  // namespace crepes
