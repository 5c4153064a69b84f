/// Writes numbers of any width as bits, the lowest bit first.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace crepes {

class BitWriter {
 public:
  /// The low `count` bits of `value`; at most 32.
  void bits(std::uint64_t value, unsigned count) {
    pending_ |= (value & ((std::uint64_t{1} << count) - 1)) << pending_count_;
    pending_count_ += count;
    for (; pending_count_ >= 8; pending_count_ -= 8, pending_ >>= 8U)
      bytes_.push_back(static_cast<std::uint8_t>(pending_));
  }

  /// Exponential Golomb code of order `k`: short for numbers below 2^k (Teuhola 1978).
  void number(std::uint64_t value, unsigned k) {
    const std::uint64_t shifted = value + (std::uint64_t{1} << k);
    const auto width = static_cast<unsigned>(std::bit_width(shifted));
    for (unsigned zeros = width - 1 - k; zeros > 0; --zeros) bits(0, 1);
    bits(1, 1);
    wide_bits(shifted, width - 1);
  }

  /// The same for numbers of either sign: 0, -1, 1, -2, 2 are numbered 0, 1, 2, 3, 4.
  void signed_number(std::int64_t value, unsigned k) { number(numbered(value), k); }
  /// Bits of a signed number.
  [[nodiscard]] static std::size_t width_of(std::int64_t value, unsigned k) {
    const std::uint64_t shifted = numbered(value) + (std::uint64_t{1} << k);
    return 2 * static_cast<std::size_t>(std::bit_width(shifted)) - 1 - k;
  }

  /// As many bits as `count`, at most 64.
  void wide_bits(std::uint64_t value, unsigned count) {
    constexpr unsigned kHalf = 32;
    if (count > kHalf) {
      bits(value, kHalf);
      value >>= kHalf;
      count -= kHalf;
    }
    bits(value, count);
  }

  /// Fills the last byte with zeros.
  [[nodiscard]] std::vector<std::uint8_t> finished() && {
    if (pending_count_ > 0) bits(0, 8 - pending_count_);
    return std::move(bytes_);
  }

 private:
  [[nodiscard]] static std::uint64_t numbered(std::int64_t value) {
    const auto doubled = static_cast<std::uint64_t>(value) << 1U;
    return value < 0 ? ~doubled : doubled;
  }

  std::vector<std::uint8_t> bytes_;
  std::uint64_t pending_ = 0;
  unsigned pending_count_ = 0;
};

}  // namespace crepes
