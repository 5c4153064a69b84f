/// Reads what `BitWriter` wrote, never past the end.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace crepes {

/// Reading past the end, or a code that no writer writes, returns 0 and makes `ok()` false
/// permanently, so one check after many reads is enough.
class BitReader {
 public:
  static constexpr unsigned kMaxWidth = 48;  ///< of a number of variable length

  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// The next `count` bits; at most 32.
  [[nodiscard]] std::uint64_t bits(unsigned count) {
    if (count > remaining()) return fail();
    std::uint64_t value = 0;
    for (unsigned have = 0; have < count;) {
      const auto offset = static_cast<unsigned>(next_ % 8);
      const unsigned take = std::min(8 - offset, count - have);
      const std::uint64_t part = (bytes_[next_ / 8] >> offset) & ((1U << take) - 1);
      value |= part << have;
      have += take;
      next_ += take;
    }
    return value;
  }

  /// A number as `BitWriter::number` wrote it.
  [[nodiscard]] std::uint64_t number(unsigned k) {
    unsigned width = k;
    while (ok_ && bits(1) == 0)
      if (++width > kMaxWidth) return fail();
    return ok_ ? ((std::uint64_t{1} << width) | bits(width)) - (std::uint64_t{1} << k) : 0;
  }

  /// A number as `BitWriter::signed_number` wrote it.
  [[nodiscard]] std::int64_t signed_number(unsigned k) {
    const std::uint64_t code = number(k);
    const auto half = static_cast<std::int64_t>(code >> 1U);
    return (code & 1U) != 0 ? -half - 1 : half;
  }

  [[nodiscard]] bool ok() const { return ok_; }
  /// Only the zeros that fill the last byte remain.
  [[nodiscard]] bool at_end() const {
    return remaining() < 8 && (remaining() == 0 || bytes_.back() >> (8 - remaining()) == 0);
  }
  [[nodiscard]] std::size_t remaining() const { return 8 * bytes_.size() - next_; }

 private:
  std::uint64_t fail() {
    ok_ = false;
    next_ = 8 * bytes_.size();
    return 0;
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t next_ = 0;  ///< bit
  bool ok_ = true;
};

}  // namespace crepes
