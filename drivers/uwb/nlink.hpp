/// NoopLoop LinkTrack ranging modules.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/device_clock.hpp"
#include "drivers/uwb/nlink_frame.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/swarm_config.hpp"

namespace crepes {

/// The robot that carries each module.
using UwbModules = std::map<std::uint32_t, RobotId>;

/// A member without `uwb_id` carries the module with its robot id.
[[nodiscard]] UwbModules uwb_modules_of(const SwarmConfig& swarm);

struct NlinkCounts {
  std::uint64_t ranges = 0;
  std::uint64_t unknown_modules = 0;  ///< ranges to modules that no member carries
  std::uint64_t implausible = 0;      ///< ranges that are not positive, too long or too old
  std::uint64_t without_ranges = 0;   ///< frames of a kind without ranges
  std::uint64_t clock_restarts = 0;   ///< of the module's own clock
};

/// Extracts ranges from every kind of frame that has them.
class NlinkParser {
 public:
  using Measurement = UwbRange;
  static constexpr std::size_t kMaxFrame = kLongestNlinkFrame;
  static constexpr std::string_view kForeignMeaning =
      "the LinkTrack module is in another mode (it sends ff 02); set DR_MODE0, role NODE and "
      "NodeFrame3 with NAssistant";

  NlinkParser(UwbModules modules, double max_range_m)
      : modules_(std::move(modules)), max_range_m_(max_range_m) {}

  [[nodiscard]] static FrameCheck examine(Bytes bytes) { return examine_nlink(bytes); }

  /// Parses a whole frame, stamped by the module's clock. Ranges of NodeFrame2 carry their age and
  /// are stamped earlier by it.
  void parse(Bytes frame, Timestamp arrival, const std::function<void(const UwbRange&)>& sink);

  /// Why frames arrive without ranges, according to the last frame.
  [[nodiscard]] std::string no_measurement_reason() const;
  [[nodiscard]] const NlinkCounts& counts() const { return counts_; }

 private:
  UwbModules modules_;
  double max_range_m_;
  DeviceClock clock_;
  NlinkCounts counts_;
  NlinkKind last_kind_ = NlinkKind::kNodeFrame3;
  std::optional<std::uint32_t> stranger_;  ///< a module of the last frame that no member carries
};

}  // namespace crepes
