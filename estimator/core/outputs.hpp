/// What the estimator and the daemon tell the world.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_totals.hpp"

namespace crepes {

/// How a pose came about.
enum class PoseMode : std::uint8_t {
  kDirect,     ///< own filter, measured recently
  kGraph,      ///< reached through other robots
  kPredicted,  ///< coasting on the IMUs
};

[[nodiscard]] constexpr std::string_view name_of(PoseMode mode) {
  constexpr std::array<std::string_view, 3> kNames{"direct", "graph", "predicted"};
  return kNames[static_cast<std::size_t>(mode)];
}

/// What a pose rests on, measured within the last `predicted_after_s`.
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
};

/// Why there is no pose, the most upstream reason first.
enum class NoPoseReason : std::uint8_t {
  kNone,           ///< there is one
  kNeverHeard,     ///< no datagram from this robot
  kSilent,         ///< none for a while
  kNoClockOffset,  ///< heard, but its clock is not yet known
  kNoOwnImu,       ///< our IMU says nothing
  kNoPeerImu,      ///< its IMU says nothing
  kTiltUnknown,    ///< gravity not yet known on one of the two
  kNotSeen,        ///< our cameras do not see it
  kDoesNotSeeUs,   ///< it does not report seeing us
  kNoRange,        ///< no UWB distance
  kNearVertical,   ///< almost above or below: yaw cannot be told
  kTooClose,       ///< antennas or rings nearly coincide
  kContested,      ///< more than one place fits: mirror images, false sightings
  kUncertain,      ///< known worse than 1 m or 20 deg
};

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

/// What became of a measurement.
enum class Verdict : std::uint8_t {
  kFused,
  kGated,       ///< too unlikely
  kDegenerate,  ///< the measurement says nothing here
  kLate,        ///< older than the lag
  kNoState,     ///< nothing to correct yet
  kSkipped,     ///< another camera is listened to, or there was no time for it
};
inline constexpr std::size_t kVerdictCount = 6;

[[nodiscard]] constexpr std::string_view name_of(Verdict verdict) {
  constexpr std::array<std::string_view, kVerdictCount> kNames{"fused", "gated",    "degenerate",
                                                               "late",  "no_state", "skipped"};
  return kNames[static_cast<std::size_t>(verdict)];
}

enum class MeasurementKind : std::uint8_t {
  kBearing,      ///< our camera, the neighbor's ring
  kPeerBearing,  ///< its camera, our ring
  kRange,        ///< our module
  kPeerRange,    ///< its module
  kRawPose,      ///< paper III-C
  kGraphPose,
};
inline constexpr std::size_t kMeasurementKindCount = 6;

[[nodiscard]] constexpr std::string_view name_of(MeasurementKind kind) {
  constexpr std::array<std::string_view, kMeasurementKindCount> kNames{
      "bearing", "peer_bearing", "range", "peer_range", "raw_pose", "graph_pose"};
  return kNames[static_cast<std::size_t>(kind)];
}

/// How a measurement fared at a filter.
struct Fusion {
  static constexpr std::size_t kMaxDimension = 9;

  Verdict verdict = Verdict::kDegenerate;
  double nis = 0.0;             ///< residual^T S^-1 residual, before the correction
  double log_likelihood = 0.0;  ///< ln of the residual's density, -(NIS + ln |2 pi S|) / 2
  std::size_t dimension = 0;    ///< of the residual; 0 where there was none
  std::array<double, kMaxDimension> residual{};  ///< bearings [rad], ranges [m], poses p, theta
  std::array<double, kMaxDimension> sigma{};     ///< roots of S's diagonal
};

/// One measurement of a neighbor, for whoever wants to see inside.
struct MeasurementRecord {
  RobotId neighbor{};
  Timestamp stamp{};  ///< when it was taken
  MeasurementKind kind = MeasurementKind::kBearing;
  Fusion fusion;
};

/// What the tight filter believes of the sensors; vectors in the order of their axes.
struct CalibrationRecord {
  static constexpr std::array<std::string_view, 19> kNames{
      "gyro_B_x",     "gyro_B_y",     "gyro_B_z",     "accel_B_x",    "accel_B_y",
      "accel_B_z",    "gyro_N_x",     "gyro_N_y",     "gyro_N_z",     "accel_N_x",
      "accel_N_y",    "accel_N_z",    "range_bias",   "misalign_B_x", "misalign_B_y",
      "misalign_B_z", "misalign_N_x", "misalign_N_y", "misalign_N_z"};

  RobotId neighbor{};
  Timestamp stamp{};
  std::array<double, kNames.size()> value{};  ///< [rad/s], [m/s^2], [m], [rad]
  std::array<double, kNames.size()> sigma{};
};

struct Records {
  std::vector<MeasurementRecord> measurements;
  std::vector<CalibrationRecord> calibrations;
};

using VerdictCounts = std::array<std::uint64_t, kVerdictCount>;

struct NeighborStatus {
  RobotId neighbor{};
  std::string name;
  NoPoseReason reason = NoPoseReason::kNeverHeard;
  std::optional<NeighborPose> pose;
  std::array<VerdictCounts, kMeasurementKindCount> measurements{};  ///< [kind][verdict]
  /// When the newest of a kind was taken, whatever became of it.
  std::array<std::optional<Timestamp>, kMeasurementKindCount> newest{};
  std::optional<Timestamp> newest_imu;  ///< of its IMU's samples
  std::uint64_t id_decodes = 0;         ///< tracks that were given this robot's ID
};

struct EstimatorStatus {
  std::vector<NeighborStatus> neighbors;  ///< all members but this robot, ordered by id
  std::optional<Tilt> tilt;
  std::uint64_t unknown_senders = 0;  ///< reports from robots that are not members
  std::uint64_t refused_samples = 0;  ///< NaN, out of range, stamp that goes back
};

/// A sensor, as STATUS tells it.
struct SensorStatus {
  std::string name;
  double rate_hz = 0.0;
  bool ok = false;
  std::string message;  ///< what is wrong and what to do
  SensorTotals totals{};
};

struct ClockStatus {
  RobotId peer{};
  double offset_s = 0.0;  ///< peer's clock minus ours
  double skew_ppm = 0.0;
  double sigma_s = 0.0;
};

/// What came of one peer's datagrams.
struct PeerTraffic {
  RobotId peer{};
  std::uint64_t received = 0;
  std::uint64_t lost = 0;      ///< missing in the peer's sequence
  std::uint64_t restarts = 0;  ///< the peer or its clock began anew
  double age_s = 0.0;          ///< since the last one
};

struct QueueStatus {
  std::string name;
  std::uint64_t dropped = 0;
};

/// Which configuration is in force.
struct ConfigStatus {
  int generation = 1;                ///< 1 at start, one more with each reload that was applied
  Timestamp since{};                 ///< when that was
  std::vector<std::string> restart;  ///< keys that have changed and wait for a restart
  std::string fault;                 ///< why the last reload was refused, or empty
};

/// The answer to POLL.
struct SystemStatus {
  RobotId self{};
  std::string name;
  Timestamp stamp{};  ///< when this was so
  double uptime_s = 0.0;
  double cpu_s = 0.0;   ///< of all threads since start
  double rss_mb = 0.0;  ///< resident memory [10^6 bytes]
  ConfigStatus config;
  double config_age_s = 0.0;
  std::vector<SensorStatus> sensors;
  EstimatorStatus estimator;
  std::vector<ClockStatus> clocks;
  std::vector<PeerTraffic> traffic;
  std::vector<QueueStatus> queues;
  std::vector<std::pair<std::string, std::uint64_t>> network;  ///< datagrams and refusals by reason
};

}  // namespace crepes
