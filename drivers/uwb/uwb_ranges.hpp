/// The content of one frame of a ranging module, and the parser that all protocols share.
#pragma once

#include <concepts>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/device_clock.hpp"
#include "drivers/serial/device_request.hpp"
#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/swarm_config.hpp"

namespace crepes {

/// The robot that carries each module.
using UwbModules = std::map<std::uint32_t, RobotId>;

/// A member without `uwb_id` carries the module with its robot id.
[[nodiscard]] UwbModules uwb_modules_of(const SwarmConfig& swarm);

/// The module that a member carries; empty if there is no such member.
[[nodiscard]] std::optional<std::uint32_t> uwb_module_of(const SwarmConfig& swarm, RobotId robot);

/// A distance to another module.
struct UwbDistance {
  std::uint32_t module = 0;
  double range_m = 0.0;
  double first_path_dbm = 0.0;  ///< both powers are 0 if unknown
  double received_dbm = 0.0;
  double age_ms = 0.0;  ///< at the time of the frame
  /// The module at the near end, of devices that also report the distances of others.
  std::optional<std::uint32_t> from = std::nullopt;
};

/// The ranges of one frame, or why it has none.
struct UwbReading {
  std::vector<UwbDistance> distances = {};
  std::optional<DeviceTime> time = std::nullopt;  ///< of modules that have a clock
  std::string_view no_ranges = {};                ///< the name of a frame that never has ranges
};

/// Totals of a parser, by reason.
struct UwbCounts {
  std::uint64_t ranges = 0;
  std::uint64_t unknown_modules = 0;  ///< ranges to modules that no member carries
  std::uint64_t implausible = 0;      ///< ranges that are not positive, too long or too old
  std::uint64_t without_ranges = 0;   ///< frames of a kind without ranges
  std::uint64_t clock_restarts = 0;   ///< of the module's own clock
};

/// Turns readings into measurements of members, and knows why there are none.
class UwbRanges {
 public:
  /// `own` is this robot's module; only devices that report the distances of others need it.
  UwbRanges(UwbModules modules, double max_range_m, std::optional<std::uint32_t> own)
      : modules_(std::move(modules)), max_range_m_(max_range_m), own_(own) {}

  /// Stamps come from the module's clock if it has one, minus the age of the range.
  void forward(const UwbReading& reading, Timestamp arrival,
               const std::function<void(const UwbRange&)>& sink);

  /// Why the last reading had no ranges. Of several that are refused in turn it names the one with
  /// the lowest id, so that the reason is steady. `advice` is that of the protocol.
  [[nodiscard]] std::string no_measurement_reason(std::string_view advice) const;
  [[nodiscard]] const UwbCounts& counts() const { return counts_; }

 private:
  struct Refused {
    RobotId robot;
    bool is_old = false;
  };

  /// The module at the far end from here; empty if this robot has no part in the distance.
  [[nodiscard]] std::optional<std::uint32_t> far_end(const UwbDistance& distance) const;
  [[nodiscard]] bool is_plausible(const UwbDistance& distance) const;

  UwbModules modules_;
  double max_range_m_;
  std::optional<std::uint32_t> own_;
  DeviceClock clock_;
  UwbCounts counts_;
  std::string_view no_ranges_;             ///< of the last reading
  std::optional<std::uint32_t> stranger_;  ///< of the last seconds, a module that no member carries
  std::optional<Refused> refused_;         ///< of the last seconds
  Timestamp refused_at_ = kNever;          ///< the last of either
};

/// One frame is one reading:  `static UwbReading read(Bytes frame)`,  a pure function.
/// `kNoRanges` is the advice when frames arrive without ranges.
template <class Protocol>
concept UwbProtocolFormat = FrameProtocol<Protocol> && requires(Bytes frame) {
  { Protocol::read(frame) } -> std::same_as<UwbReading>;
  { Protocol::kNoRanges } -> std::convertible_to<std::string_view>;
};

/// Turns frames of any protocol into ranges, and counts the refused ones.
template <UwbProtocolFormat Protocol>
class UwbFrameParser {
 public:
  using Measurement = UwbRange;
  static constexpr std::size_t kMaxFrame = Protocol::kMaxFrame;
  static constexpr std::string_view kForeignMeaning = Protocol::kForeignMeaning;

  explicit UwbFrameParser(UwbModules modules, double max_range_m,
                          std::optional<std::uint32_t> own = std::nullopt)
      : ranges_(std::move(modules), max_range_m, own) {}

  [[nodiscard]] static FrameCheck examine(Bytes bytes) { return Protocol::examine(bytes); }
  [[nodiscard]] static DeviceRequest request(std::size_t number) requires requires {
    Protocol::request(number);
  }
  { return Protocol::request(number); }

  void parse(Bytes frame, Timestamp arrival, const std::function<void(const UwbRange&)>& sink) {
    ranges_.forward(Protocol::read(frame), arrival, sink);
  }

  [[nodiscard]] std::string no_measurement_reason() const {
    return ranges_.no_measurement_reason(Protocol::kNoRanges);
  }
  [[nodiscard]] const UwbCounts& counts() const { return ranges_.counts(); }

 private:
  UwbRanges ranges_;
};

}  // namespace crepes
