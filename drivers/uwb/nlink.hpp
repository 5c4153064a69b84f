/// NoopLoop LinkTrack ranging modules: the NLink protocol.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/serial/frame_decoder.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/measurements.hpp"

namespace crepes {

/// Which robot carries which module.
using UwbModules = std::map<std::uint32_t, RobotId>;

/// A member without `uwb_id` carries the module of its own number.
[[nodiscard]] UwbModules uwb_modules_of(const SwarmConfig& swarm);

struct NlinkCounts {
  std::uint64_t ranges = 0;
  std::uint64_t unknown_modules = 0;  ///< ranges to modules that no member carries
  std::uint64_t implausible = 0;      ///< ranges that are not positive, too long or too old
};

/// Ranges from NodeFrame2 and NodeFrame3 frames.
class NlinkParser {
 public:
  using Measurement = UwbRange;
  static constexpr std::size_t kMaxFrame = 119 + 255 * 13 + 1;  ///< NodeFrame2, 255 nodes
  static constexpr std::string_view kForeignMeaning =
      "the LinkTrack module is in another mode (it sends ff 02); set DR_MODE0, role NODE and "
      "NodeFrame3 with NAssistant";

  NlinkParser(UwbModules modules, double max_range_m)
      : modules_(std::move(modules)), max_range_m_(max_range_m) {}

  /// `bytes` begin a frame of this protocol?
  [[nodiscard]] static FrameCheck examine(Bytes bytes);

  /// A whole frame. Ranges of NodeFrame2 carry their own age and are stamped that much earlier.
  void parse(Bytes frame, Timestamp arrival, const std::function<void(const UwbRange&)>& sink);

  [[nodiscard]] const NlinkCounts& counts() const { return counts_; }

 private:
  UwbModules modules_;
  double max_range_m_;
  NlinkCounts counts_;
};

/// What a module says of one other module.
struct NlinkNode {
  std::uint8_t module = 0;
  double range_m = 0.0;
  double first_path_dbm = 0.0;
  double received_dbm = 0.0;
};

/// The frame that a module with role NODE sends; times are milliseconds of the module's clocks.
[[nodiscard]] std::vector<std::uint8_t> encode_node_frame3(std::uint8_t module,
                                                           std::uint32_t system_time_ms,
                                                           const std::vector<NlinkNode>& nodes);

}  // namespace crepes
