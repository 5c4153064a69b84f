/// What can go wrong in a swarm, drawn from a seed.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
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
  kImuSlow,
  kImuScaled,
  kImuLate,
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
  kGarbageFlood,
  kForgedFlood,
  kReplay,
  kReplayedSession,
  kDoubledId,
  // a robot as a whole
  kReboot,
  kRebootLoop,
  kKilled,
  kFreeze,
  kClockStep,
  kClockSkew,
  kWrongKey,
  kOldKey,
  kNoKey,
  kWrongSignature,
  kReload,
  kReloadVision,
  kMemberRemoved,
  kMemberExcluded,
  kLiarEstimates,
  kLiarTilt,
  kLiarRanges,
  kLiarBearings,
  kLiarImu,
  kLiarExtremes,
  kLiarWithinBounds,
  // its clients
  kClientsFlood,
  kClientsComeAndGo,
};

/// Whose poses may suffer while it lasts.
enum class Scope : std::uint8_t {
  kRobot,   ///< those of and about the robot
  kNobody,  ///< none: data are missing, late or forged, but what is used is true
};

/// `rate`: what `Fault::rate`, 0.2 to 1, scales; empty where a fault has no measure but its time.
struct KindOf {
  Kind kind;
  std::string_view name;
  Scope scope;
  std::string_view rate{};
};

inline constexpr std::array kKinds{
    KindOf{Kind::kImuStuck, "imu-stuck", Scope::kRobot},
    KindOf{Kind::kImuSpikes, "imu-spikes", Scope::kRobot, "10 % of the samples"},
    KindOf{Kind::kImuSaturated, "imu-saturated", Scope::kRobot},
    KindOf{Kind::kImuAxesSwapped, "imu-axes-swapped", Scope::kRobot},
    KindOf{Kind::kImuGap, "imu-gap", Scope::kNobody},
    KindOf{Kind::kImuHalfRate, "imu-half-rate", Scope::kNobody},
    KindOf{Kind::kImuScaled, "imu-scaled", Scope::kRobot, "too large by 100 %"},
    KindOf{Kind::kImuLate, "imu-late", Scope::kRobot},
    KindOf{Kind::kUwbConstant, "uwb-constant", Scope::kRobot},
    KindOf{Kind::kUwbOffset, "uwb-offset", Scope::kRobot, "1.5 m"},
    KindOf{Kind::kUwbNegative, "uwb-negative", Scope::kNobody},
    KindOf{Kind::kUwbWrongIds, "uwb-wrong-ids", Scope::kRobot},
    KindOf{Kind::kUwbNoSight, "uwb-no-sight", Scope::kRobot, "up to 1.5 m"},
    KindOf{Kind::kUwbSlow, "uwb-slow", Scope::kNobody},
    KindOf{Kind::kUwbGap, "uwb-gap", Scope::kNobody},
    KindOf{Kind::kCameraFrozen, "camera-frozen", Scope::kRobot},
    KindOf{Kind::kCameraBlack, "camera-black", Scope::kNobody},
    KindOf{Kind::kCameraWhite, "camera-white", Scope::kNobody, "100 false spots"},
    KindOf{Kind::kCameraLosesFrames, "camera-loses-frames", Scope::kNobody, "80 % of the frames"},
    KindOf{Kind::kCameraLate, "camera-late", Scope::kRobot},
    KindOf{Kind::kCameraMirrors, "camera-mirrors", Scope::kRobot},
    KindOf{Kind::kCameraOtherCodes, "camera-other-codes", Scope::kRobot},
    KindOf{Kind::kLoss, "loss", Scope::kNobody, "60 %"},
    KindOf{Kind::kBurstLoss, "burst-loss", Scope::kNobody, "40 % of every 2 s"},
    KindOf{Kind::kDelay, "delay", Scope::kNobody, "0.25 s, one way"},
    KindOf{Kind::kJitter, "jitter", Scope::kNobody, "0.25 s"},
    KindOf{Kind::kDuplication, "duplication", Scope::kNobody, "5 copies"},
    KindOf{Kind::kPartition, "partition", Scope::kNobody},
    KindOf{Kind::kOneWay, "one-way", Scope::kNobody},
    KindOf{Kind::kDamage, "damage", Scope::kNobody, "60 % of the datagrams"},
    KindOf{Kind::kTruncation, "truncation", Scope::kNobody, "800 bytes are left"},
    KindOf{Kind::kGarbageFlood, "garbage-flood", Scope::kNobody, "20 for every datagram"},
    KindOf{Kind::kForgedFlood, "forged-flood", Scope::kNobody, "20 for every datagram"},
    KindOf{Kind::kReplay, "replay", Scope::kNobody, "10 for every datagram"},
    KindOf{Kind::kReplayedSession, "replayed-session", Scope::kNobody, "10 for every datagram"},
    KindOf{Kind::kDoubledId, "doubled-id", Scope::kNobody},
    KindOf{Kind::kReboot, "reboot", Scope::kNobody},
    KindOf{Kind::kRebootLoop, "reboot-loop", Scope::kNobody, "off and on for 0.5 s each"},
    KindOf{Kind::kFreeze, "freeze", Scope::kNobody},
    KindOf{Kind::kClockStep, "clock-step", Scope::kRobot, "2 s ahead"},
    KindOf{Kind::kClockSkew, "clock-skew", Scope::kNobody, "200 ppm"},
    KindOf{Kind::kWrongKey, "wrong-key", Scope::kNobody},
    KindOf{Kind::kNoKey, "no-key", Scope::kNobody},
    KindOf{Kind::kWrongSignature, "wrong-signature", Scope::kNobody},
    KindOf{Kind::kReload, "reload", Scope::kNobody},
    KindOf{Kind::kReloadVision, "reload-vision", Scope::kNobody},
    KindOf{Kind::kMemberRemoved, "member-removed", Scope::kNobody},
    KindOf{Kind::kMemberExcluded, "member-excluded", Scope::kNobody},
    KindOf{Kind::kLiarEstimates, "liar-estimates", Scope::kRobot, "2 m"},
    KindOf{Kind::kLiarTilt, "liar-tilt", Scope::kRobot},
    KindOf{Kind::kLiarRanges, "liar-ranges", Scope::kRobot, "50 % too long"},
    KindOf{Kind::kLiarBearings, "liar-bearings", Scope::kRobot, "0.3 rad"},
    KindOf{Kind::kLiarImu, "liar-imu", Scope::kRobot, "too large by 100 %"},
    KindOf{Kind::kLiarExtremes, "liar-extremes", Scope::kRobot},
    KindOf{Kind::kClientsFlood, "clients-flood", Scope::kNobody, "4000 requests a second"},
    KindOf{Kind::kClientsComeAndGo, "clients-come-and-go", Scope::kNobody, "100 a second"},
    KindOf{Kind::kImuSlow, "imu-slow", Scope::kNobody, "means of 6 samples"},
    KindOf{Kind::kKilled, "killed", Scope::kNobody},
    KindOf{Kind::kOldKey, "old-key", Scope::kNobody},
    KindOf{Kind::kLiarWithinBounds, "liar-within-bounds", Scope::kRobot},
};

/// Seeds up to this one draw the first kinds only, so that a seed stays what it was when kinds are
/// added.
inline constexpr std::uint64_t kLastSeedOfFirstKinds = 1000;
inline constexpr std::size_t kFirstKinds = 56;

struct Fault {
  Kind kind{};
  RobotId robot{};
  double from_s = 0.0;  ///< true time
  double to_s = 0.0;
  double rate = 1.0;       ///< as `KindOf::rate` describes it
  std::uint64_t seed = 0;  ///< of its own details

  [[nodiscard]] bool lasts_at(double true_s) const { return true_s >= from_s && true_s < to_s; }
};

[[nodiscard]] const KindOf& about(Kind kind);
/// "loss r2 5.10 7.25 0.60 123": kind, robot, times [s], rate, seed.
[[nodiscard]] std::string to_string(const Fault& fault);
/// Empty for a text that is no fault.
[[nodiscard]] std::optional<Fault> parse_fault(const std::string& text);

/// When faults happen [s].
struct FaultTimes {
  double from_s = 0.0;
  double to_s = 0.0;
  double longest_s = 0.0;                ///< each
  double longest_without_sight_s = 0.0;  ///< of ranges without line of sight
};

/// One to three faults of any kinds among robots 1 to `robots`. Every second seed has one alone.
[[nodiscard]] std::vector<Fault> draw_faults(std::uint64_t seed, int robots,
                                             const FaultTimes& times);

}  // namespace crepes::faults
