/// Outputs of the estimator: poses, verdicts, records, status.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/team_solution.hpp"

namespace crepes {

/// The source of a pose.
enum class PoseMode : std::uint8_t {
  kDirect,     ///< own filter, measured recently
  kGraph,      ///< reached through other robots
  kPredicted,  ///< coasting on the IMUs
};

/// As it is called in POSE and in files.
[[nodiscard]] constexpr std::string_view name_of(PoseMode mode) {
  constexpr std::array<std::string_view, 3> kNames{"direct", "graph", "predicted"};
  return kNames[static_cast<std::size_t>(mode)];
}

/// The measurements of a pose within the last `predicted_after_s`.
struct PoseSources {
  bool bearing = false;       ///< we see the neighbor
  bool peer_bearing = false;  ///< the neighbor sees us
  bool range = false;
  bool imu = false;  ///< both robots' IMUs
  bool graph = false;
};

/// The published pose of one neighbor, T_B_N with B the observer's body at `stamp`.
struct NeighborPose {
  RobotId neighbor{};
  Timestamp stamp{};      ///< the instant of the state
  Timestamp published{};  ///< when it leaves; at most 20 ms after `stamp`
  PoseMode mode = PoseMode::kPredicted;
  GaussianPose T_B_N;
  Eigen::Vector3d v_B_N = Eigen::Vector3d::Zero();  ///< R_W_B^T (v_W_N - v_W_B) [m/s]
  double age_s = 0.0;                               ///< since the last measurement that was used
  std::uint32_t reset_counter = 0;                  ///< grows when the filter starts anew
  PoseSources sources;
  std::optional<Eigen::Vector3d> up_B;  ///< unit vector against gravity at `stamp`, if known
};

/// Why there is no pose, the most upstream reason first.
enum class NoPoseReason : std::uint8_t {
  kNone,           ///< there is one
  kNeverHeard,     ///< no datagram from this robot
  kSilent,         ///< none for a while
  kNoClockOffset,  ///< heard, but its clock is not yet known
  kNoOwnImu,       ///< our IMU is silent or faulty
  kNoPeerImu,      ///< its IMU is silent or faulty
  kTiltUnknown,    ///< gravity not yet known on one of the two
  kNotSeen,        ///< our cameras do not see it
  kDoesNotSeeUs,   ///< it does not report seeing us
  kNoRange,        ///< no UWB distance
  kNearVertical,   ///< almost above or below: yaw is not observable
  kTooClose,       ///< antennas or rings nearly coincide
  kContested,      ///< more than one place fits: mirror images, false sightings
  kUncertain,      ///< known worse than 1 m or 20 deg
};

/// In words, for STATUS.
[[nodiscard]] constexpr std::string_view name_of(NoPoseReason reason) {
  constexpr std::array<std::string_view, 14> kNames{"none",
                                                    "never heard",
                                                    "silent",
                                                    "clock offset unknown",
                                                    "own IMU silent",
                                                    "peer IMU silent",
                                                    "tilt unknown",
                                                    "not seen",
                                                    "does not see us",
                                                    "no range",
                                                    "near the vertical",
                                                    "too close",
                                                    "contested",
                                                    "uncertain"};
  return kNames[static_cast<std::size_t>(reason)];
}

/// The outcome of a measurement.
enum class Verdict : std::uint8_t {
  kFused,
  kGated,       ///< too unlikely
  kDegenerate,  ///< the model is singular here
  kLate,        ///< older than the lag
  kNoState,     ///< nothing to correct yet
  kSkipped,     ///< another camera is in use, or no time was left
};
inline constexpr std::size_t kVerdictCount = 6;

/// As it is called in STATUS and in files.
[[nodiscard]] constexpr std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, kVerdictCount> kNames{"fused", "gated",    "degenerate",
                                                               "late",  "no_state", "skipped"};
  return kNames[static_cast<std::size_t>(verdict)];
}

/// Who measured what.
enum class MeasurementKind : std::uint8_t {
  kBearing,       ///< our camera, the neighbor's ring
  kPeerBearing,   ///< its camera, our ring
  kRange,         ///< our module
  kPeerRange,     ///< its module
  kRingDistance,  ///< our camera, by the size of the neighbor's ring
  kRawPose,       ///< paper III-C
  kGraphPose,
};
inline constexpr std::size_t kMeasurementKindCount = 7;

/// As it is called in STATUS and in files.
[[nodiscard]] constexpr std::string_view name_of(MeasurementKind kind) {
  constexpr std::array<std::string_view, kMeasurementKindCount> kNames{
      "bearing", "peer_bearing", "range", "peer_range", "ring_distance", "raw_pose", "graph_pose"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// The result of fusing a measurement.
struct Fusion {
  static constexpr std::size_t kMaxDimension = 9;

  Verdict verdict = Verdict::kDegenerate;
  double nis = 0.0;             ///< residual^T S^-1 residual, before the correction
  double log_likelihood = 0.0;  ///< ln of the residual's density, -(NIS + ln |2 pi S|) / 2
  std::size_t dimension = 0;    ///< of the residual; 0 where there was none
  std::array<double, kMaxDimension> residual{};  ///< bearings [rad], ranges [m], poses p, theta
  std::array<double, kMaxDimension> sigma{};     ///< roots of S's diagonal
};

/// What a sensor read, as it came: of a bearing u and the camera's place, both in the seeing
/// robot's body; of a range or a ring the distance [m]. Poses have no numbers.
using SensorReading = std::array<double, 6>;
/// How many of its numbers a kind has.
[[nodiscard]] constexpr std::size_t reading_size(MeasurementKind kind) {
  constexpr std::array<std::size_t, kMeasurementKindCount> kSizes{6, 6, 1, 1, 1, 0, 0};
  return kSizes[static_cast<std::size_t>(kind)];
}

/// One measurement of a neighbor, with its result.
struct MeasurementRecord {
  RobotId neighbor{};
  Timestamp stamp{};  ///< when it was taken
  MeasurementKind kind = MeasurementKind::kBearing;
  Fusion fusion;
  SensorReading reading{};
};
/// The newest measurement of a kind.
struct NewestReading {
  Timestamp stamp{};                    ///< when it was taken
  Verdict verdict = Verdict::kNoState;  ///< what became of it
  SensorReading reading{};              ///< as it came
};

/// The sensor calibration that the tight filter estimates.
struct CalibrationRecord {
  /// Where each quantity begins in `value` and `sigma`; vectors are in the order of their axes.
  enum Index : std::size_t {
    kGyroB = 0,
    kAccelB = 3,
    kGyroN = 6,
    kAccelN = 9,
    kRangeBias = 12,
    kMisalignB = 13,
    kMisalignN = 16,
    kSize = 19,
  };
  static constexpr std::array<std::string_view, kSize> kNames{
      "gyro_B_x",     "gyro_B_y",     "gyro_B_z",     "accel_B_x",    "accel_B_y",
      "accel_B_z",    "gyro_N_x",     "gyro_N_y",     "gyro_N_z",     "accel_N_x",
      "accel_N_y",    "accel_N_z",    "range_bias",   "misalign_B_x", "misalign_B_y",
      "misalign_B_z", "misalign_N_x", "misalign_N_y", "misalign_N_z"};

  RobotId neighbor{};
  Timestamp stamp{};
  std::array<double, kSize> value{};  ///< [rad/s], [m/s^2], [m], [rad]
  std::array<double, kSize> sigma{};
};

/// What the team's filter found over an interval that ends at `stamp`.
struct TeamRecord {
  Timestamp stamp{};
  std::vector<TeamResidual> residuals;
  std::vector<RobotCalibration> calibrations;
  std::vector<TeamFault> faults;
};

/// The outcome of each measurement, and calibrations over time.
struct Records {
  std::vector<MeasurementRecord> measurements;
  std::vector<CalibrationRecord> calibrations;
  std::vector<TeamRecord> team{};
};

using VerdictCounts = std::array<std::uint64_t, kVerdictCount>;

/// Why an inertial sample was refused.
enum class ImuFault : std::uint8_t {
  kImplausible,  ///< NaN, out of range, or for seconds without gravity, as in another unit
  kSpike,        ///< its predecessors and its successors agree without it
  kJump,         ///< a change that no robot makes within a sample, and what followed it
  kHangs,        ///< the sensor, or one of its axes, repeats its value
  kSaturated,    ///< an axis is at the end of its range
};
inline constexpr std::size_t kImuFaultCount = 5;
using ImuFaultCounts = std::array<std::uint64_t, kImuFaultCount>;

/// As it is called in STATUS and in reports.
[[nodiscard]] constexpr std::string_view name_of(ImuFault fault) {
  constexpr std::array<std::string_view, kImuFaultCount> kNames{"implausible", "spike", "jump",
                                                                "hangs", "saturated"};
  return kNames[static_cast<std::size_t>(fault)];
}

/// How well measurements of a kind agree with what was expected of them.
struct ResidualStatus {
  std::optional<double> nis;  ///< mean for each dimension, of those fused recently; honest: 1
  std::uint64_t fused = 0;
  std::uint64_t refused = 0;
};

/// A robot as the team's filter knows it.
struct TeamRobotStatus {
  RobotCalibration calibration;
  std::array<ResidualStatus, kTeamResidualKindCount> residuals{};  ///< of what it measured
  std::vector<TeamFault> faults;
};

/// All robots that the team's filter estimates, with this one.
struct TeamStatus {
  Timestamp stamp{};  ///< of the latest solution
  std::vector<TeamRobotStatus> robots;
};

/// The state of one neighbor, for STATUS.
struct NeighborStatus {
  RobotId neighbor{};
  std::string name;
  NoPoseReason reason = NoPoseReason::kNeverHeard;
  std::optional<NeighborPose> pose;
  std::array<VerdictCounts, kMeasurementKindCount> measurements{};  ///< [kind][verdict]
  /// Of each kind, whatever its outcome.
  std::array<std::optional<NewestReading>, kMeasurementKindCount> newest{};
  PairMounting mounting;  ///< what these readings refer to
  /// Mean NIS for each dimension, of about the last fifty that were fused, by kind.
  std::array<std::optional<double>, kMeasurementKindCount> nis{};
  std::optional<CalibrationRecord> calibration;  ///< of its filter
  /// Measured minus expected, own and the neighbor's ranges: the mean of about the last sixteen
  /// [m].
  std::optional<double> range_residual_m;
  std::optional<Timestamp> newest_imu;  ///< of its IMU's samples
  ImuFaultCounts refused_imu{};         ///< its IMU's samples, by reason
  std::uint64_t id_decodes = 0;         ///< tracks decoded to this robot's ID
  std::vector<TeamFault> faults;        ///< what the team finds wrong with it
};

/// Lights that were named where and when their board was expected, before their blinking was read.
struct PredictedIds {
  std::uint64_t confirmed = 0;    ///< read afterwards
  std::uint64_t unconfirmed = 0;  ///< not read as predicted within 0.3 s; no filter used them
};

/// The state of the estimator, for STATUS.
struct EstimatorStatus {
  std::vector<NeighborStatus> neighbors;  ///< all members but this robot, ordered by id
  std::optional<Tilt> tilt;
  std::uint64_t unknown_senders = 0;  ///< reports from robots that are not members
  std::uint64_t refused_samples = 0;  ///< NaN, out of range, stamp that goes back, refused_imu
  ImuFaultCounts refused_imu{};       ///< of our IMU, by reason
  std::vector<TeamFault> faults;      ///< what the team finds wrong with us
  PredictedIds predicted_ids;
  std::uint64_t foreign_boards = 0;  ///< lights that blink nearly as a member, but are none
  std::optional<TeamStatus> team;
};

}  // namespace crepes
