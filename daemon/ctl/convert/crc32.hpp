/// The checksum of MCAP, zip and PNG: CRC-32 with the reflected polynomial 0xEDB88320.
#pragma once

#include <cstdint>
#include <string_view>

namespace crepes {

class Crc32 {
 public:
  void add(std::string_view bytes);
  /// Of all bytes so far.
  [[nodiscard]] std::uint32_t value() const { return ~state_; }

 private:
  std::uint32_t state_ = 0xFFFFFFFFU;
};

}  // namespace crepes
