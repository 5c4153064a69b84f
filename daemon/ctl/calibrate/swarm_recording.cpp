#include "daemon/ctl/calibrate/swarm_recording.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "daemon/ctl/calibrate/board_sightings.hpp"
#include "daemon/ctl/replay/swarm_replay.hpp"
#include "estimator/calibration/imu/vibration.hpp"

namespace crepes {
namespace {

constexpr double kShareOfReplay = 0.7;

/// How far cameras and ranges may be off while everybody is looked for. More doubt finds more, and
/// too much finds nothing.
struct Doubt {
  double camera_deg = 0.0;
  double range_m = 0.0;
};
constexpr std::array kDoubts{Doubt{1.5, 0.2}, Doubt{0.0, 0.0}};

/// The poses of a replay, by observer and neighbor.
struct ReplayedPoses {
  std::map<RobotId, std::map<RobotId, std::vector<EstimatedPose>>> poses;
  std::map<RobotId, std::vector<EstimatedUp>> up;

  void add(RobotId observer, const NeighborPose& pose) {
    poses[observer][pose.neighbor].push_back({pose.stamp, pose.T_B_N.pose, pose.v_B_N});
    if (!pose.up_B) return;
    std::vector<EstimatedUp>& list = up[observer];
    if (list.empty() || list.back().stamp < pose.stamp) list.push_back({pose.stamp, *pose.up_B});
  }
  [[nodiscard]] std::vector<EstimatedPose> of(RobotId observer, RobotId neighbor) const {
    const auto found = poses.find(observer);
    if (found == poses.end()) return {};
    const auto list = found->second.find(neighbor);
    return list == found->second.end() ? std::vector<EstimatedPose>() : list->second;
  }
  [[nodiscard]] std::vector<EstimatedUp> up_of(RobotId observer) const {
    const auto list = up.find(observer);
    return list == up.end() ? std::vector<EstimatedUp>() : list->second;
  }
  /// How many poses it had of the robot that it saw least.
  [[nodiscard]] std::size_t least(RobotId observer, std::size_t others) const {
    const auto found = poses.find(observer);
    if (found == poses.end() || found->second.size() < others) return 0;
    std::size_t least = found->second.begin()->second.size();
    for (const auto& [neighbor, list] : found->second) least = std::min(least, list.size());
    return least;
  }
};

/// A calibration that is good enough to look for everybody with.
SwarmDataset doubtful(SwarmDataset dataset, const Doubt& doubt) {
  for (RobotRecording& robot : dataset.robots) {
    EstimatorConfig& estimator = robot.config.estimator;
    estimator.camera_misalignment_deg =
        std::max(estimator.camera_misalignment_deg, doubt.camera_deg);
    RangeNoise& ranges = robot.config.uwb.noise;
    ranges.bias_sigma_m = std::max(ranges.bias_sigma_m, doubt.range_m);
    for (CameraConfig& camera : robot.config.cameras) camera.calibration.calibrated = true;
  }
  return dataset;
}

/// A neighbor's clock against the reference's: offset = a + b (t - t0), by least squares.
class ClockLine {
 public:
  ClockLine() = default;
  ClockLine(const std::vector<ClockSample>& samples, RobotId reference, RobotId neighbor) {
    std::vector<std::pair<double, double>> points;
    for (const ClockSample& sample : samples) {
      if (sample.observer == reference && sample.clock.peer == neighbor)
        points.emplace_back(to_seconds(sample.stamp.time_since_epoch()), sample.clock.offset_s);
    }
    fit(points);
  }

  [[nodiscard]] bool is_known() const { return is_known_; }
  [[nodiscard]] Timestamp reference_time(Timestamp neighbor) const {
    const double t_s = to_seconds(neighbor.time_since_epoch());
    const double own_s = t0_s_ + (t_s - a_s_ - t0_s_) / (1.0 + b_);
    return neighbor - from_seconds(t_s - own_s);
  }

 private:
  void fit(std::vector<std::pair<double, double>> points) {
    constexpr std::size_t kSettling = 3;  // the first samples, about one a second
    if (points.size() > 2 * kSettling)
      points.erase(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(kSettling));
    if (points.empty()) return;
    is_known_ = true;
    const auto count = static_cast<double>(points.size());
    for (const auto& [t_s, offset_s] : points) {
      t0_s_ += t_s / count;
      a_s_ += offset_s / count;
    }
    double tt = 0.0;
    double to = 0.0;
    for (const auto& [t_s, offset_s] : points) {
      tt += (t_s - t0_s_) * (t_s - t0_s_);
      to += (t_s - t0_s_) * (offset_s - a_s_);
    }
    if (tt > 1.0) b_ = to / tt;
  }

  bool is_known_ = false;
  double t0_s_ = 0.0;
  double a_s_ = 0.0;
  double b_ = 0.0;
};

std::vector<RobotRange> direct_ranges(const RobotRecording& robot,
                                      const std::map<RobotId, std::size_t>& index_of,
                                      const ClockLine& clock) {
  const RangeNoise& noise = robot.config.uwb.noise;
  std::vector<RobotRange> ranges;
  for (const UwbRange& range : robot.ranges) {
    const auto other = index_of.find(range.neighbor);
    const bool is_late = range.received_dbm - range.first_path_dbm > noise.late_path_db;
    if (other == index_of.end() || range.neighbor == robot.robot.id || is_late ||
        range.range_m > noise.max_range_m)
      continue;
    ranges.push_back({clock.reference_time(range.stamp), other->second, range.range_m});
  }
  return ranges;
}

Result<RobotRecord> record_of(const RobotRecording& robot,
                              const std::map<RobotId, std::size_t>& index_of,
                              const ClockLine& clock) {
  RobotRecord record;
  record.imu = robot.imu;
  for (ImuSample& sample : record.imu) sample.stamp = clock.reference_time(sample.stamp);
  record.noise = noise_with_vibration(robot.config.imu.noise, robot.imu, 2);
  record.range_noise = robot.config.uwb.noise;
  record.ranges = direct_ranges(robot, index_of, clock);
  const auto found = board_sightings(robot, robot.config.cameras.front().calibration, true);
  if (!found) return tl::unexpected(found.error());
  for (BoardSighting sighting : found->sightings) {
    const auto other = index_of.find(found->boards[sighting.board]);
    if (other == index_of.end()) continue;
    sighting.board = other->second;
    sighting.stamp = clock.reference_time(sighting.stamp);
    record.sightings.push_back(sighting);
  }
  return record;
}

std::size_t best_observer(const SwarmDataset& dataset, const ReplayedPoses& replayed) {
  const std::size_t others = dataset.robots.size() - 1;
  const auto better = [&](const RobotRecording& a, const RobotRecording& b) {
    return replayed.least(a.robot.id, others) < replayed.least(b.robot.id, others);
  };
  return static_cast<std::size_t>(std::ranges::max_element(dataset.robots, better) -
                                  dataset.robots.begin());
}

struct ReplayedSwarm {
  ReplayedPoses poses;
  std::vector<ClockSample> clocks;
};

Result<ReplayedSwarm> replayed_swarm(const SwarmDataset& dataset,
                                     const std::function<void(double)>& progress) {
  ReplayedSwarm replayed;
  for (std::size_t i = 0; i < kDoubts.size(); ++i) {
    replayed = {};
    ReplaySinks sinks;
    sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
      replayed.poses.add(observer, pose);
    };
    ReplayOptions options;
    options.on_progress = [&](double done) {
      progress((static_cast<double>(i) + done) / static_cast<double>(kDoubts.size()));
    };
    auto report = replay_dataset(doubtful(dataset, kDoubts.at(i)), std::nullopt, options, sinks);
    if (!report) return tl::unexpected(report.error());
    replayed.clocks = std::move(report->clocks);
    const RobotId best = dataset.robots[best_observer(dataset, replayed.poses)].robot.id;
    if (replayed.poses.least(best, dataset.robots.size() - 1) > 0) break;
  }
  return replayed;
}

}  // namespace

Result<RobotConstants> configured_constants(const Config& config) {
  if (config.cameras.empty()) return fail(ErrorCode::kConfig, "no camera is configured");
  const CameraCalibration& camera = config.cameras.front().calibration;
  if (camera.camera_model != CameraModelKind::kDoubleSphere || camera.intrinsics.size() != 6) {
    return fail(ErrorCode::kConfig,
                "cameras[0].camera_model: only ds (Double Sphere) can be "
                "calibrated with a swarm");
  }
  RobotConstants constants;
  constants.camera.lens = Eigen::Map<const LensVector>(camera.intrinsics.data());
  constants.camera.q_C_B = camera.T_cam_imu.q;
  constants.camera.p_B_C = camera.T_cam_imu.inverse().p;
  constants.camera.shift_s = camera.timeshift_cam_imu;
  const auto self = std::ranges::find(config.swarm.members, config.robot.id, &MemberConfig::id);
  if (self != config.swarm.members.end()) {
    constants.p_B_M = self->p_body_led;
    constants.p_B_U = self->p_body_uwb;
    constants.range_delay_m = self->range_delay_m;
  }
  return constants;
}

Result<SwarmMeasurements> swarm_measurements(const SwarmDataset& dataset,
                                             const std::function<void(double)>& on_progress) {
  const auto progress = [&](double done) {
    if (on_progress) on_progress(done);
  };
  const auto found = replayed_swarm(dataset, [&](double done) { progress(kShareOfReplay * done); });
  if (!found) return tl::unexpected(found.error());

  SwarmMeasurements all;
  all.start.reference = best_observer(dataset, found->poses);
  const RobotId reference = dataset.robots[all.start.reference].robot.id;
  all.start.up = found->poses.up_of(reference);
  std::map<RobotId, std::size_t> index_of;
  for (std::size_t r = 0; r < dataset.robots.size(); ++r) index_of[dataset.robots[r].robot.id] = r;
  for (std::size_t r = 0; r < dataset.robots.size(); ++r) {
    const RobotRecording& robot = dataset.robots[r];
    const RobotId id = robot.robot.id;
    const ClockLine clock = id == reference ? ClockLine() : ClockLine(found->clocks, reference, id);
    if (id != reference && !clock.is_known()) {
      return fail(ErrorCode::kFormat,
                  fmt::format("{}: its clock against {}'s stays unknown", robot.robot.name,
                              dataset.robots[all.start.reference].robot.name));
    }
    auto guess = configured_constants(robot.config);
    if (!guess) return tl::unexpected(std::move(guess.error()).with_context(robot.robot.name));
    all.guess.push_back(*guess);
    auto record = record_of(robot, index_of, clock);
    if (!record) return tl::unexpected(record.error());
    all.records.push_back(std::move(*record));
    all.start.poses.push_back(found->poses.of(reference, id));
    progress(kShareOfReplay + (1.0 - kShareOfReplay) * static_cast<double>(r + 1) /
                                  static_cast<double>(dataset.robots.size()));
  }
  return all;
}

}  // namespace crepes
