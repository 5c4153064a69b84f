/// Autopilots and other devices that speak MAVLink.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Versions 1 and 2. HIGHRES_IMU and SCALED_IMU to SCALED_IMU3 hold samples; their axes (x forward,
/// y right, z down) are converted to ours (x forward, y left, z up). The numbers of RAW_IMU have no
/// unit, but for ArduPilot's: "on ArduPilot platforms, this message is identical to SCALED_IMU"
/// (common.xml).
struct Mavlink {
  static constexpr std::size_t kMaxFrame =
      10 + 255 + 2 + 13 + 1;  ///< version 2, signed, and a byte
  static constexpr std::string_view kNoSamples =
      "MAVLink without an IMU message; have the autopilot send HIGHRES_IMU (105) at "
      "imu.update_rate "
      "on this port";
  static constexpr std::string_view kOnlyRaw =
      "MAVLink with RAW_IMU only, whose numbers have no unit; have the autopilot send HIGHRES_IMU "
      "(105) or SCALED_IMU (26)";

  /// The checksums of unknown messages cannot be computed. They are passed over as `kUnchecked` if
  /// another message begins where they end.
  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  /// `is_ardupilot`: the sender's autopilot, which scales RAW_IMU.
  [[nodiscard]] static ImuReading read(Bytes frame, bool is_ardupilot = false);
};

/// Several messages may report the same motion. The best kind is used (HIGHRES_IMU, SCALED_IMU,
/// ArduPilot's RAW_IMU, SCALED_IMU2, SCALED_IMU3), from one sender. Another is used only after a
/// second of silence.
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
  [[nodiscard]] bool is_ardupilot(Bytes frame) const;

  std::optional<Source> source_;
  std::set<std::uint8_t> ardupilots_;  ///< systems whose heartbeats say so
  DeviceClock clock_;
  ImuCounts counts_;
};

}  // namespace crepes
