/// Xsens inertial sensors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// What the numbers of a message are, best first.
enum class XsensQuantity : std::uint8_t {
  kCalibrated,  ///< acceleration (4020) and rate of turn (8020)
  kHighRate,    ///< the same before the filter: 4040 and 8040
  kIncrement,   ///< velocity and orientation increments: delta_v (4010) and delta_q (8030)
  kNone,
};

/// The items of one message.
struct XsensMessage {
  XsensQuantity quantity = XsensQuantity::kNone;
  /// Of increments: the rotation [rad] and the change of velocity [m/s] of one output period.
  ImuReading reading;
  std::optional<std::uint16_t> counter = std::nullopt;  ///< of messages
};

/// Messages `fa`, bus, kind, length; a sample is an MTData2 (kind 36) that holds both the
/// acceleration and the rate of turn, in any of the number formats.
struct Xsens {
  static constexpr std::size_t kMaxFrame = 7 + 2048;
  static constexpr std::string_view kNoSamples =
      "the Xsens sensor does not send acceleration (4020) and rate of turn (8020) together; "
      "choose both, at the same rate, with MT Manager";
  static constexpr std::string_view kOldFormat =
      "the Xsens sensor sends the old format MTData (32), which does not say what it contains; "
      "choose MTData2 with MT Manager";
  static constexpr std::string_view kNoPeriod =
      "the Xsens sensor sends delta_v and delta_q without the packet counter (1020) and the fine "
      "sample time (1060), so their period is unknown; add both with MT Manager";

  [[nodiscard]] static FrameCheck examine(Bytes bytes);
  [[nodiscard]] static XsensMessage read_message(Bytes frame);
  [[nodiscard]] static ImuReading read(Bytes frame) { return read_message(frame).reading; }
};

/// The time that one increment covers, from the messages' counter and the sensor's clock, whose
/// steps of 0.1 ms are too coarse for one period. Pure.
class IncrementPeriod {
 public:
  /// Empty during the first second, and after a jump of either.
  [[nodiscard]] std::optional<double> update(DeviceTime time, std::uint16_t counter);

 private:
  struct Mark {
    std::uint64_t ticks_ns = 0;
    std::uint16_t counter = 0;
  };
  void restart(const Mark& mark);

  std::optional<Mark> last_;
  double elapsed_s_ = 0.0;
  std::uint64_t messages_ = 0;
  std::uint64_t stride_ = 0;  ///< messages from one increment to the next
};

/// Uses the best quantity only, of one sensor of the bus. Another is used only after a second of
/// silence.
class XsensParser {
 public:
  using Measurement = ImuSample;
  static constexpr std::size_t kMaxFrame = Xsens::kMaxFrame;
  static constexpr std::string_view kForeignMeaning = {};

  [[nodiscard]] static FrameCheck examine(Bytes bytes) { return Xsens::examine(bytes); }
  void parse(Bytes frame, Timestamp arrival, const std::function<void(const ImuSample&)>& sink);

  [[nodiscard]] std::string no_measurement_reason() const;
  [[nodiscard]] const ImuCounts& counts() const { return counts_; }

 private:
  struct Source {
    std::uint8_t bus = 0;
    XsensQuantity quantity = XsensQuantity::kNone;
    Timestamp heard{};
  };
  [[nodiscard]] bool is_chosen(std::uint8_t bus, XsensQuantity quantity, Timestamp arrival);
  /// Makes rates of increments.
  void divide_by_period(XsensMessage& message);

  std::optional<Source> source_;
  IncrementPeriod period_;
  bool sends_old_format_ = false;
  bool lacks_period_ = false;
  DeviceClock clock_;
  ImuCounts counts_;
};

}  // namespace crepes
