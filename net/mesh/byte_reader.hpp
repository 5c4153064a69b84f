/// Reads little-endian numbers from bytes, never past the end.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <type_traits>

namespace crepes {

/// Reading past the end returns 0 and makes `ok()` false permanently, so one check after many reads
/// is enough.
class ByteReader {
 public:
  explicit ByteReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class Integer>
  [[nodiscard]] Integer read() {
    static_assert(std::is_integral_v<Integer>);
    using Unsigned = std::make_unsigned_t<Integer>;
    if (bytes_.size() < sizeof(Integer)) {
      ok_ = false;
      bytes_ = {};
      return 0;
    }
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) value |= std::uint64_t{bytes_[i]} << (8 * i);
    bytes_ = bytes_.subspan(sizeof(Integer));
    return static_cast<Integer>(static_cast<Unsigned>(value));
  }

  [[nodiscard]] double read_float() {
    return static_cast<double>(std::bit_cast<float>(read<std::uint32_t>()));
  }

  /// Nothing was read past the end.
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size(); }

 private:
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace crepes
