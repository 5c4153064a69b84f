/// Autopilots and other devices that speak MAVLink.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Versions 1 and 2. HIGHRES_IMU, SCALED_IMU and SCALED_IMU2 hold samples; their axes (x forward,
/// y right, z down) are converted to ours (x forward, y left, z up). RAW_IMU is refused: its
/// numbers have no unit.
struct Mavlink {
  static constexpr std::size_t kMaxFrame = 10 + 255 + 2 + 13;  ///< version 2, signed
  static constexpr std::string_view kNoSamples =
      "MAVLink without an IMU message; have the autopilot send HIGHRES_IMU (105) at "
      "imu.update_rate "
      "on this port";
  static constexpr std::string_view kOnlyRaw =
      "MAVLink with RAW_IMU only, whose numbers have no unit; have the autopilot send HIGHRES_IMU "
      "(105) or SCALED_IMU (26)";

  /// Messages of unknown kinds cannot be checked and count as skipped bytes.
  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static ImuReading read(Bytes frame);
};

/// Several messages may report the same motion. The best kind is used (HIGHRES_IMU, then
/// SCALED_IMU, then SCALED_IMU2), from one sender. Another is used only after a second of silence.
class MavlinkParser {
 public:
  using Measurement = ImuSample;
  static constexpr std::size_t kMaxFrame = Mavlink::kMaxFrame;
  static constexpr std::string_view kForeignMeaning = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes) { return Mavlink::examine(bytes); }
  void parse(Bytes frame, Timestamp arrival, const std::function<void(const ImuSample&)>& sink);

  [[nodiscard]] std::string no_measurement_reason() const;
  [[nodiscard]] const ImuCounts& counts() const { return counts_; }

 private:
  struct Source {
    int rank = 0;  ///< smaller is better
    std::uint64_t sender = 0;
    Timestamp heard{};
  };
  [[nodiscard]] bool is_chosen(Bytes frame, Timestamp arrival);

  std::optional<Source> source_;
  DeviceClock clock_;
  ImuCounts counts_;
};

}  // namespace crepes
