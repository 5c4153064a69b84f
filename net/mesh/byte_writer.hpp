/// Writes numbers as little-endian bytes, never past a limit.
#pragma once

#include <bit>
#include <cstdint>
#include <type_traits>
#include <utility>
#include <vector>

namespace crepes {

/// A number that would exceed the limit is not written and makes `ok()` false permanently.
class ByteWriter {
 public:
  explicit ByteWriter(std::size_t limit) : limit_(limit) { bytes_.reserve(limit); }

  template <class Integer>
  void write(std::type_identity_t<Integer> value) {
    static_assert(std::is_integral_v<Integer>);
    using Unsigned = std::make_unsigned_t<Integer>;
    if (!ok_ || remaining() < sizeof(Integer)) {
      ok_ = false;
      return;
    }
    const std::uint64_t bits{static_cast<Unsigned>(value)};
    for (std::size_t i = 0; i < sizeof(Integer); ++i)
      bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
  }

  void write_float(double value) {
    write<std::uint32_t>(std::bit_cast<std::uint32_t>(static_cast<float>(value)));
  }

  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] std::size_t remaining() const { return limit_ - bytes_.size(); }
  [[nodiscard]] const std::vector<std::uint8_t>& bytes() const { return bytes_; }
  [[nodiscard]] std::vector<std::uint8_t> release() && { return std::move(bytes_); }

 private:
  std::vector<std::uint8_t> bytes_;
  std::size_t limit_;
  bool ok_ = true;
};

}  // namespace crepes
