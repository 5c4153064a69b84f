/// Decawave (Qorvo) DWM1001 modules with the PANS firmware.
#pragma once

#include <cstddef>
#include <string_view>

#include "drivers/serial/device_request.hpp"
#include "drivers/uwb/uwb_ranges.hpp"

namespace crepes {

/// The lines that the module's shell prints after `lec` or `les`: a tag's distances to its anchors.
///   DIST,4,AN0,022E,7.94,8.03,0.00,3.44,AN1,...,POS,6.95,5.37,-1.97,52
///   022E[7.94,8.03,0.00]=3.38 9280[...]=5.49 le_us=3082 est[6.97,5.17,-1.77,53]
/// A module is named by the last four hexadecimal digits of its id. As the module drops characters
/// at high rates, a line counts only as a whole.
struct Dwm1001Shell {
  static constexpr std::size_t kMaxFrame = 512;
  static constexpr std::string_view kForeignMeaning = {};
  static constexpr std::string_view kNoRanges = "have its shell print distances: lec";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static UwbReading read(Bytes frame);

  /// While it is silent: opens the shell (two carriage returns), then asks for `lec`.
  [[nodiscard]] static DeviceRequest request(std::size_t number);
};

/// The answers to dwm_loc_get (DWM1001 Firmware API Guide, 5.3.10) in the binary mode, in which the
/// module starts: of tags (type 49) and of anchors (type 48).
struct Dwm1001Tlv {
  static constexpr std::size_t kMaxFrame = 20 + 255;
  static constexpr std::string_view kForeignMeaning = {};
  static constexpr std::string_view kNoRanges = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static UwbReading read(Bytes frame);

  /// dwm_loc_get, ten times a second.
  [[nodiscard]] static DeviceRequest request(std::size_t number);
};

using Dwm1001ShellParser = UwbFrameParser<Dwm1001Shell>;
using Dwm1001TlvParser = UwbFrameParser<Dwm1001Tlv>;

}  // namespace crepes
