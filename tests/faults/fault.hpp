/// What can go wrong in a swarm, drawn from a seed.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"

namespace crepes::faults {

enum class Kind : std::uint8_t {
  // one robot's sensors
  kImuStuck,
  kImuSpikes,
  kImuSaturated,
  kImuAxesSwapped,
  kImuGap,
  kImuHalfRate,
  kUwbConstant,
  kUwbOffset,
  kUwbNegative,
  kUwbWrongIds,
  kUwbNoSight,
  kUwbSlow,
  kUwbGap,
  kCameraFrozen,
  kCameraBlack,
  kCameraWhite,
  kCameraLosesFrames,
  kCameraLate,
  kCameraMirrors,
  kCameraOtherCodes,
  // the network
  kLoss,
  kBurstLoss,
  kDelay,
  kJitter,
  kDuplication,
  kPartition,
  kOneWay,
  kDamage,
  kTruncation,
  kReplay,
  kDoubledId,
  // a robot as a whole
  kReboot,
  kFreeze,
  kLiarEstimates,
  kLiarTilt,
  kLiarRanges,
};

/// Whose poses may suffer while it lasts.
enum class Scope : std::uint8_t {
  kRobot,   ///< those of and about the robot
  kNobody,  ///< none: data are missing, late or forged, but what is used is true
};

struct KindOf {
  Kind kind;
  std::string_view name;
  Scope scope;
};

inline constexpr std::array kKinds{
    KindOf{Kind::kImuStuck, "imu-stuck", Scope::kRobot},
    KindOf{Kind::kImuSpikes, "imu-spikes", Scope::kRobot},
    KindOf{Kind::kImuSaturated, "imu-saturated", Scope::kRobot},
    KindOf{Kind::kImuAxesSwapped, "imu-axes-swapped", Scope::kRobot},
    KindOf{Kind::kImuGap, "imu-gap", Scope::kNobody},
    KindOf{Kind::kImuHalfRate, "imu-half-rate", Scope::kNobody},
    KindOf{Kind::kUwbConstant, "uwb-constant", Scope::kRobot},
    KindOf{Kind::kUwbOffset, "uwb-offset", Scope::kRobot},
    KindOf{Kind::kUwbNegative, "uwb-negative", Scope::kNobody},
    KindOf{Kind::kUwbWrongIds, "uwb-wrong-ids", Scope::kRobot},
    KindOf{Kind::kUwbNoSight, "uwb-no-sight", Scope::kRobot},
    KindOf{Kind::kUwbSlow, "uwb-slow", Scope::kNobody},
    KindOf{Kind::kUwbGap, "uwb-gap", Scope::kNobody},
    KindOf{Kind::kCameraFrozen, "camera-frozen", Scope::kRobot},
    KindOf{Kind::kCameraBlack, "camera-black", Scope::kNobody},
    KindOf{Kind::kCameraWhite, "camera-white", Scope::kNobody},
    KindOf{Kind::kCameraLosesFrames, "camera-loses-frames", Scope::kNobody},
    KindOf{Kind::kCameraLate, "camera-late", Scope::kRobot},
    KindOf{Kind::kCameraMirrors, "camera-mirrors", Scope::kRobot},
    KindOf{Kind::kCameraOtherCodes, "camera-other-codes", Scope::kRobot},
    KindOf{Kind::kLoss, "loss", Scope::kNobody},
    KindOf{Kind::kBurstLoss, "burst-loss", Scope::kNobody},
    KindOf{Kind::kDelay, "delay", Scope::kNobody},
    KindOf{Kind::kJitter, "jitter", Scope::kNobody},
    KindOf{Kind::kDuplication, "duplication", Scope::kNobody},
    KindOf{Kind::kPartition, "partition", Scope::kNobody},
    KindOf{Kind::kOneWay, "one-way", Scope::kNobody},
    KindOf{Kind::kDamage, "damage", Scope::kNobody},
    KindOf{Kind::kTruncation, "truncation", Scope::kNobody},
    KindOf{Kind::kReplay, "replay", Scope::kNobody},
    KindOf{Kind::kDoubledId, "doubled-id", Scope::kNobody},
    KindOf{Kind::kReboot, "reboot", Scope::kNobody},
    KindOf{Kind::kFreeze, "freeze", Scope::kNobody},
    KindOf{Kind::kLiarEstimates, "liar-estimates", Scope::kRobot},
    KindOf{Kind::kLiarTilt, "liar-tilt", Scope::kRobot},
    KindOf{Kind::kLiarRanges, "liar-ranges", Scope::kRobot},
};

struct Fault {
  Kind kind{};
  RobotId robot{};
  double from_s = 0.0;  ///< true time
  double to_s = 0.0;
  std::uint64_t seed = 0;  ///< of its own details

  [[nodiscard]] bool lasts_at(double true_s) const { return true_s >= from_s && true_s < to_s; }
};

[[nodiscard]] const KindOf& about(Kind kind);
[[nodiscard]] std::string to_string(const Fault& fault);

/// One to three faults of any kinds among robots 1 to `robots`, between `from_s` and `to_s`.
[[nodiscard]] std::vector<Fault> draw_faults(std::uint64_t seed, int robots, double from_s,
                                             double to_s);

}  // namespace crepes::faults
