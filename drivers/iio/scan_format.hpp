/// The layout of the scans that a Linux IIO device writes to its buffer. Pure.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One number of a scan, as `scan_elements/..._type` describes it.
struct ScanElement {
  std::endian order = std::endian::little;
  bool is_signed = true;
  unsigned bits = 16;          ///< that are valid
  unsigned storage_bits = 16;  ///< 8, 16, 32 or 64
  unsigned shift = 0;          ///< to the right, before use

  [[nodiscard]] bool operator==(const ScanElement&) const = default;
};

/// Reads `[be|le]:[s|u]bits/storagebits[>>shift]`. Refuses repeated and floating-point elements.
[[nodiscard]] Result<ScanElement> parse_scan_element(std::string_view text);

/// Elements in the order of their index. The kernel aligns each to its own size.
class ScanLayout {
 public:
  ScanLayout() = default;
  explicit ScanLayout(std::vector<ScanElement> elements);

  /// Bytes of one scan.
  [[nodiscard]] std::size_t size() const { return size_; }
  /// The number of element `index`; `scan` has `size()` bytes. Of unsigned numbers of 64 bits the
  /// highest bit is taken for a sign.
  [[nodiscard]] std::int64_t value(Bytes scan, std::size_t index) const;

 private:
  std::vector<ScanElement> elements_;
  std::vector<std::size_t> offsets_;
  std::size_t size_ = 0;
};

}  // namespace crepes
