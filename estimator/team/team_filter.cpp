#include "estimator/team/team_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/team_update.hpp"

namespace crepes {
namespace {

constexpr int kMotion = FreeMotionAt::kMotion;
constexpr int kBias = FreeMotionAt::kBias;
// An estimate that starts a robot shares its errors with what follows, so it counts little.
constexpr double kStartPosition = 0.05;          // m
constexpr double kStartAttitude = radians(1.0);  // rad
constexpr double kStartSpeed = 0.3;              // m/s
constexpr double kMaxPosition = 3.0;             // m; a robot known worse is dropped
constexpr double kUnknownDistance = 0.10;        // m; the least by which a step is judged
constexpr double kLinear = 0.01;                 // rad, and relative to the distance
constexpr int kMaxIterations = 4;
constexpr double kAgreementMemory = 0.5;             // s
constexpr std::size_t kMaxCameras = 4;               // of a robot, whatever it reports
constexpr double kLeastVariance = 1e-12;             // of a prior: one known exactly stays regular
constexpr double kUnknownAlignment = radians(20.0);  // rad; sigma of a camera that is realigned
constexpr Duration kRefusal = std::chrono::seconds{20};  // of a camera; then it is tried again
constexpr Duration kProbation = std::chrono::seconds{1};
// Ranges about a robot that nobody sees would make its direction appear known, little by little.
constexpr Duration kDark = std::chrono::seconds{1};
constexpr Duration kLossMemory = std::chrono::seconds{10};
constexpr double kDoubtPerLoss = 4.0;  // a robot that was contradicted starts so much less certain
// A pair's range bias is mostly its modules' antenna delays, the same toward everybody: so much of
// its variance. The rest is the pair's own, and drifts.
constexpr double kShareOfModules = 0.8;
// A misalignment is a fault beyond so many sigmas of its prior and of its estimate.
constexpr double kWrongPriors = 4.0;
constexpr double kWrongSigmas = 3.0;
// An accelerometer's scale errors act as a bias that changes while the robot turns, and keeps its
// direction for so long.
constexpr double kTurnMemory = 1.0;                  // s
constexpr double kLeastMisalignment = radians(0.1);  // rad

std::pair<RobotId, RobotId> ordered(RobotId a, RobotId b) {
  return a < b ? std::pair(a, b) : std::pair(b, a);
}

const TeamMember* member_of(const TeamInterval& interval, RobotId robot) {
  const auto found = std::ranges::find(interval.members, robot, &TeamMember::robot);
  return found == interval.members.end() ? nullptr : &*found;
}

bool is_inside(const TeamInterval& interval, Timestamp stamp) {
  return stamp > interval.from && stamp <= interval.to;
}

/// A camera may be misaligned by so much. A configuration may claim to know it exactly.
double largest_misalignment(const Priors& priors) {
  return kWrongPriors * std::max(priors.misalignment_rad, kLeastMisalignment);
}

/// Mean over an interval [rad/s].
double turn_rate(const TeamMember& member) {
  double sum = 0.0;
  for (const ImuMean& mean : member.imu) sum += mean.gyro_radps.norm();
  return sum / static_cast<double>(std::max<std::size_t>(1, member.imu.size()));
}

/// Whether this robot itself has an estimate of the other one, or is estimated by it.
bool has_own_edge(const TeamInterval& interval, RobotId id) {
  return std::ranges::any_of(interval.edges, [&](const RelativePoseEdge& edge) {
    return ordered(edge.from, edge.to) == ordered(interval.self, id);
  });
}

Matrix6d start_floor() {
  Vector6d variance;
  variance << Eigen::Vector3d::Constant(kStartPosition * kStartPosition),
      Eigen::Vector3d::Constant(kStartAttitude * kStartAttitude);
  return variance.asDiagonal();
}

bool is_usable(const RelativePoseEdge& edge) {
  const Matrix6d& covariance = edge.T_from_to.covariance;
  return edge.T_from_to.pose.p.allFinite() && edge.T_from_to.pose.q.coeffs().allFinite() &&
         edge.v_from_to.allFinite() && covariance.allFinite() &&
         Eigen::LLT<Matrix6d>(covariance).info() == Eigen::Success;
}

/// Near hovering, an accelerometer's scale and axis errors act as a bias that gravity causes.
double accel_bias_variance(const Priors& priors) {
  return priors.accel_bias_mps2 * priors.accel_bias_mps2 +
         std::pow(priors.accel_scale * kGravityMps2, 2);
}

}  // namespace

/// All bearings of one camera to one robot.
struct TeamFilter::Sight {
  RobotId observer{};
  RobotId neighbor{};
  std::size_t camera = 0;
  std::vector<const Bearing*> bearings{};

  /// Of their mean, after the beginning of the interval.
  [[nodiscard]] double time_s(const TeamInterval& interval) const {
    double sum_s = 0.0;
    for (const Bearing* z : bearings) sum_s += to_seconds(z->stamp - interval.from);
    return sum_s / static_cast<double>(bearings.size());
  }
  [[nodiscard]] double sigma_rad() const {
    double variance = 0.0;
    for (const Bearing* z : bearings) variance += z->sigma_rad * z->sigma_rad;
    return std::sqrt(variance / static_cast<double>(bearings.size()));
  }
};

/// All ranges that one robot measured to another.
struct TeamFilter::Ranging {
  RobotId observer{};
  RobotId neighbor{};
  std::vector<const TeamRange*> ranges{};
};

struct TeamFilter::Readings {
  std::vector<Sight> sights;
  std::vector<Ranging> rangings;
};

TeamSolution TeamFilter::step(const TeamInterval& interval) {
  if (member_of(interval, interval.self) == nullptr || interval.to <= interval.from) {
    robots_.clear();
    return {.stamp = interval.to, .poses = {}, .biases = {}, .faults = {}};
  }
  if (robots_.empty() || interval.self != self_ || interval.from != stamp_) reset(interval);
  remove_members(interval);
  judge_cameras(interval);
  trust_members();
  add_calibrations(interval);
  if (!correct(interval)) reset(interval);
  advance(interval);
  TeamSolution solution{.stamp = stamp_, .poses = {}, .biases = {}, .faults = {}};
  add_members(interval, solution);
  report(interval, solution);
  return solution;
}

void TeamFilter::reset(const TeamInterval& interval) {
  self_ = interval.self;
  stamp_ = interval.from;
  robots_.clear();
  ranges_.clear();
  P_.resize(0, 0);
  TeamRobot& self = robots_[self_];
  self.bias_index = append_calibration(interval.settings.priors);
  self.is_trusted = true;
}

int TeamFilter::append(int count, double sigma) {
  const Eigen::Index n = P_.rows();
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(n + count, n + count);
  P.topLeftCorner(n, n) = P_;
  P.diagonal().tail(count).setConstant(std::max(sigma * sigma, kLeastVariance));
  P_ = std::move(P);
  return static_cast<int>(n);
}

int TeamFilter::append_calibration(const Priors& priors) {
  const int index = append(kBias, priors.gyro_scale);
  const double gyro = priors.gyro_bias_radps * priors.gyro_bias_radps;
  P_.diagonal().segment<3>(index).setConstant(std::max(gyro, kLeastVariance));
  P_.diagonal().segment<3>(index + 3).setConstant(
      std::max(accel_bias_variance(priors), kLeastVariance));
  append(1, std::sqrt(0.5 * kShareOfModules) * priors.range_bias_m);
  return index;
}

void TeamFilter::erase(int index, int count) {
  const Eigen::Index rest = P_.rows() - index - count;
  Eigen::MatrixXd P(P_.rows() - count, P_.rows() - count);
  P.topLeftCorner(index, index) = P_.topLeftCorner(index, index);
  P.topRightCorner(index, rest) = P_.topRightCorner(index, rest);
  P.bottomLeftCorner(rest, index) = P_.bottomLeftCorner(rest, index);
  P.bottomRightCorner(rest, rest) = P_.bottomRightCorner(rest, rest);
  P_ = std::move(P);
  const auto shift = [&](int& i) { i -= i > index ? count : 0; };
  for (auto& [id, robot] : robots_) {
    shift(robot.motion_index);
    shift(robot.bias_index);
    for (TeamCamera& camera : robot.cameras) shift(camera.index);
  }
  for (auto& [pair, range] : ranges_) shift(range.index);
}

/// How many cameras agree with a robot's place, and how many contradict it. A camera that is
/// refused or turned is no witness.
TeamFilter::Witnesses TeamFilter::witnesses(bool with_turned) const {
  Witnesses witnesses;
  for (const auto& [id, robot] : robots_) {
    for (const TeamCamera& camera : robot.cameras) {
      if (camera.is_refused || (!with_turned && is_turned(id, camera))) continue;
      for (const auto& [neighbor, agreement] : camera.agreement) {
        Agreement& of_neighbor = witnesses[neighbor];
        if (agreement.is_contradiction()) {
          of_neighbor.gated += 1.0;
        } else if (agreement.fused > 1.0) {
          of_neighbor.fused += 1.0;
        }
      }
    }
  }
  return witnesses;
}

/// It contradicts most of the robots that it sees, at least two, and nobody contradicts the place
/// of the robot that carries it.
bool TeamFilter::is_turned(RobotId observer, const TeamCamera& camera) const {
  const auto seen = std::ranges::count_if(camera.agreement, [](const auto& entry) {
    return entry.second.fused + entry.second.gated > 1.0;
  });
  const auto contradicted = std::ranges::count_if(
      camera.agreement, [](const auto& entry) { return entry.second.is_contradiction(); });
  if (contradicted < 2 || 2 * contradicted <= seen) return false;
  const auto all = witnesses(true);
  const auto of_observer = all.find(observer);
  return of_observer == all.end() || of_observer->second.gated == 0.0;
}

/// Robots without IMU, known too badly, or contradicted by most cameras that see them. Where as
/// many agree, the robot that came last is in the wrong.
void TeamFilter::remove_members(const TeamInterval& interval) {
  const Witnesses all = witnesses(false);
  const auto is_contradicted = [&](RobotId id) {
    const auto found = all.find(id);
    if (found == all.end() || found->second.gated == 0.0) return false;
    const Agreement& of_robot = found->second;
    const bool came_last = std::ranges::none_of(all, [&](const auto& other) {
      return other.second.gated > 0.0 && robots_.at(other.first).since > robots_.at(id).since;
    });
    return of_robot.gated > of_robot.fused || (of_robot.gated == of_robot.fused && came_last);
  };
  // A robot that was away may have been repaired.
  std::erase_if(realigned_,
                [&](const auto& entry) { return member_of(interval, entry.first) == nullptr; });
  std::vector<RobotId> lost;
  for (const auto& [id, robot] : robots_) {
    if (id == self_) continue;
    const double variance = P_.diagonal().segment<3>(robot.motion_index).sum();
    const bool is_wrong = is_contradicted(id);
    if (is_wrong) losses_[id] = {stamp_, recent_losses(id) + 1};
    if (is_wrong || member_of(interval, id) == nullptr || !(variance < kMaxPosition * kMaxPosition))
      lost.push_back(id);
  }
  for (const RobotId id : lost) remove(id);
}

int TeamFilter::recent_losses(RobotId robot) const {
  const auto found = losses_.find(robot);
  const bool is_recent = found != losses_.end() && stamp_ - found->second.last < kLossMemory;
  return is_recent ? found->second.count : 0;
}

/// Ends the probation of robots whose measurements agreed with the trusted ones for long enough.
void TeamFilter::trust_members() {
  std::map<RobotId, Agreement> all;
  for (const auto& [id, robot] : robots_) {
    for (const TeamCamera& camera : robot.cameras) {
      for (const auto& [neighbor, agreement] : camera.agreement) {
        for (const RobotId end : {id, neighbor}) {
          all[end].fused += agreement.fused;
          all[end].gated += agreement.gated;
        }
      }
    }
  }
  for (auto& [id, robot] : robots_) {
    const Agreement& agreement = all[id];
    if (stamp_ - robot.since >= kProbation && agreement.fused > 4.0 * agreement.gated + 2.0)
      robot.is_trusted = true;
  }
}

void TeamFilter::remove(RobotId id) {
  const TeamRobot robot = robots_.at(id);
  std::vector<std::pair<int, int>> blocks{{robot.motion_index, kMotion},
                                          {robot.bias_index, TeamRobot::kCalibration}};
  for (const TeamCamera& camera : robot.cameras) blocks.emplace_back(camera.index, 3);
  for (auto range = ranges_.begin(); range != ranges_.end();) {
    const bool concerned = range->first.first == id || range->first.second == id;
    if (concerned) blocks.emplace_back(range->second.index, 1);
    range = concerned ? ranges_.erase(range) : std::next(range);
  }
  robots_.erase(id);
  std::ranges::sort(blocks, std::greater{});
  for (const auto& [index, count] : blocks) erase(index, count);
  for (auto& [other, observer] : robots_)
    for (TeamCamera& camera : observer.cameras) camera.agreement.erase(id);
}

/// A robot with a turned camera has a wrong attitude too. It starts anew with a camera whose
/// direction is unknown, so that the others' measurements determine it. If that camera contradicts
/// them again, it is refused. If the robot was trusted, it has strained everybody's calibration,
/// and all start anew.
void TeamFilter::judge_cameras(const TeamInterval& interval) {
  const double most = largest_misalignment(interval.settings.priors);
  std::vector<RobotId> turned;
  for (const auto& [id, robot] : robots_) {
    const bool is_unknown = is_realigned(id);
    for (const TeamCamera& camera : robot.cameras) {
      if (is_turned(id, camera) || (!is_unknown && camera.misalignment.norm() > most)) {
        turned.push_back(id);
        break;
      }
    }
  }
  bool has_strained = false;
  for (const RobotId id : turned) {
    realigned_[id] = {.since = stamp_, .is_refused = is_realigned(id)};
    has_strained = has_strained || robots_.at(id).is_trusted;
    if (id != self_) remove(id);
  }
  if (has_strained) reset(interval);
}

bool TeamFilter::is_realigned(RobotId robot) const {
  const auto found = realigned_.find(robot);
  return found != realigned_.end() &&
         (!found->second.is_refused || stamp_ - found->second.since < kRefusal);
}

/// States for cameras and pairs that measure for the first time.
void TeamFilter::add_calibrations(const TeamInterval& interval) {
  const auto& priors = interval.settings.priors;
  for (const TeamBearing& reading : interval.bearings) {
    const auto observer = robots_.find(reading.observer);
    if (observer == robots_.end() || !robots_.contains(reading.bearing.neighbor)) continue;
    auto& cameras = observer->second.cameras;
    if (cameras.size() < kMaxCameras &&
        std::ranges::find(cameras, reading.bearing.p_B_C, &TeamCamera::p_B_C) == cameras.end()) {
      const bool is_unknown = is_realigned(reading.observer);
      cameras.push_back(
          {.p_B_C = reading.bearing.p_B_C,
           .index = append(3, is_unknown ? kUnknownAlignment : priors.misalignment_rad),
           .is_refused = is_unknown && realigned_.at(reading.observer).is_refused});
    }
  }
  for (const TeamRange& reading : interval.ranges) {
    if (!robots_.contains(reading.observer) || !robots_.contains(reading.neighbor)) continue;
    const Pair pair = ordered(reading.observer, reading.neighbor);
    if (!ranges_.contains(pair))
      ranges_[pair] = {.index = append(1, std::sqrt(1.0 - kShareOfModules) * priors.range_bias_m)};
  }
}

TeamFilter::Trajectories TeamFilter::trajectories(const TeamInterval& interval) const {
  Trajectories paths;
  const double duration_s = to_seconds(interval.to - interval.from);
  for (const TeamMember& member : interval.members) {
    const auto robot = robots_.find(member.robot);
    if (robot == robots_.end()) continue;
    paths.try_emplace(member.robot, robot->second.motion, robot->second.bias, member.imu,
                      duration_s, interval.settings.noise);
  }
  return paths;
}

/// Nothing is learned from two robots on probation.
bool TeamFilter::takes_part(RobotId observer, RobotId neighbor, Stage stage) const {
  const auto i = robots_.find(observer);
  const auto j = robots_.find(neighbor);
  if (i == robots_.end() || j == robots_.end()) return false;
  return stage == Stage::kTrusted ? i->second.is_trusted && j->second.is_trusted
                                  : i->second.is_trusted != j->second.is_trusted;
}

TeamFilter::Readings TeamFilter::readings(const TeamInterval& interval, Stage stage) const {
  std::map<std::tuple<RobotId, RobotId, std::size_t>, Sight> sights;
  for (const TeamBearing& reading : interval.bearings) {
    const Bearing& z = reading.bearing;
    if (!takes_part(reading.observer, z.neighbor, stage) || !is_inside(interval, z.stamp)) continue;
    const auto& cameras = robots_.at(reading.observer).cameras;
    const auto camera = std::ranges::find(cameras, z.p_B_C, &TeamCamera::p_B_C);
    if (camera == cameras.end() || camera->is_refused) continue;
    const auto index = static_cast<std::size_t>(camera - cameras.begin());
    Sight& sight = sights[{reading.observer, z.neighbor, index}];
    sight.observer = reading.observer;
    sight.neighbor = z.neighbor;
    sight.camera = index;
    sight.bearings.push_back(&z);
  }
  const auto is_dark = [&](RobotId id) {
    return interval.to - robots_.at(id).last_sighting > kDark;
  };
  std::map<Pair, Ranging> rangings;
  for (const TeamRange& reading : interval.ranges) {
    if (!takes_part(reading.observer, reading.neighbor, stage) ||
        !is_inside(interval, reading.stamp) || is_dark(reading.observer) ||
        is_dark(reading.neighbor))
      continue;
    Ranging& ranging = rangings[{reading.observer, reading.neighbor}];
    ranging.observer = reading.observer;
    ranging.neighbor = reading.neighbor;
    ranging.ranges.push_back(&reading);
  }
  Readings all;
  for (auto& [key, sight] : sights) all.sights.push_back(std::move(sight));
  for (auto& [key, ranging] : rangings) all.rangings.push_back(std::move(ranging));
  return all;
}

TeamPair TeamFilter::pair(const TeamInterval& interval, const Trajectories& paths, RobotId observer,
                          RobotId neighbor) const {
  return {robots_.at(observer),           robots_.at(neighbor), *member_of(interval, observer),
          *member_of(interval, neighbor), paths.at(observer),   paths.at(neighbor)};
}

/// Covariance of the position of `to` relative to `from`.
Eigen::Matrix3d TeamFilter::position_covariance(RobotId from, RobotId to) const {
  const int i = robots_.at(from).motion_index;
  const int j = robots_.at(to).motion_index;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  if (i >= 0) covariance += P_.block<3, 3>(i, i);
  if (j >= 0) covariance += P_.block<3, 3>(j, j);
  if (i >= 0 && j >= 0) covariance -= P_.block<3, 3>(i, j) + P_.block<3, 3>(j, i);
  return covariance;
}

namespace {

/// The mean of what a pair measured may be false, although its gate accepts it: then nothing in it
/// is information. Mean and variance become those of the mixture (probabilistic data association,
/// Bar-Shalom and Tse 1975). `S` is the innovation's variance. False if it is more likely false.
bool associate(double S, TeamRow& row) {
  constexpr double kFalseRanges = 0.05;  // 1/m, as for the pairs' filters
  const double residual = row.residual.x();
  const double nis = residual * residual / S;
  const double density = std::exp(-0.5 * nis) / std::sqrt(2.0 * std::numbers::pi * S);
  const double is_true = density / (density + kFalseRanges);
  const double weight = is_true * (1.0 - (1.0 - is_true) * nis);
  if (is_true < 0.5 || weight <= 0.0) return false;
  row.variance += S / weight - S;
  row.residual.x() *= is_true / weight;
  return true;
}

}  // namespace

/// Drops readings that are too unlikely, and counts how each camera and pair agrees.
void TeamFilter::gate(const TeamInterval& interval, const Trajectories& paths, Readings& readings) {
  for (Sight& sight : readings.sights) {
    const TeamPair ends = pair(interval, paths, sight.observer, sight.neighbor);
    TeamCamera& camera = robots_.at(sight.observer).cameras[sight.camera];
    const auto model = SightModel::at(ends, camera, sight.time_s(interval), sight.sigma_rad());
    if (!model) {
      sight.bearings.clear();
      continue;
    }
    const Eigen::LLT<Eigen::Matrix2d> S(model->row().covariance(P_));
    Agreement& agreement = camera.agreement[sight.neighbor];
    std::erase_if(sight.bearings, [&](const Bearing* z) {
      const auto residual =
          model->residual(ends, camera, z->u_B, to_seconds(z->stamp - interval.from));
      const bool fits =
          residual && residual->dot(S.solve(*residual)) <= interval.settings.bearing_gate;
      agreement.add(fits);
      return !fits;
    });
    for (const Bearing* z : sight.bearings) {
      for (const RobotId robot : {sight.observer, sight.neighbor}) {
        Timestamp& last = robots_.at(robot).last_sighting;
        last = std::max(last, z->stamp);
      }
    }
  }
  for (Ranging& ranging : readings.rangings) {
    const TeamPair ends = pair(interval, paths, ranging.observer, ranging.neighbor);
    TeamRangeBias& bias = ranges_.at(ordered(ranging.observer, ranging.neighbor));
    const Eigen::Matrix3d covariance = position_covariance(ranging.observer, ranging.neighbor);
    std::erase_if(ranging.ranges, [&](const TeamRange* z) {
      const auto row =
          range_row(ends, bias, z->reading, to_seconds(z->stamp - interval.from), covariance);
      if (!row) return true;
      const double residual = row->residual.x();
      const bool fits =
          residual * residual <= interval.settings.range_gate * row->covariance(P_)(0, 0);
      bias.add(ranging.observer, fits, residual);
      return !fits;
    });
  }
  std::erase_if(readings.sights, [](const Sight& s) { return s.bearings.empty(); });
  std::erase_if(readings.rangings, [](const Ranging& r) { return r.ranges.empty(); });
}

/// One row a sight and one a pair's ranges: the mean of what was not gated.
std::vector<TeamRow> TeamFilter::rows(const TeamInterval& interval, const Trajectories& paths,
                                      const Readings& readings) const {
  std::vector<TeamRow> rows;
  rows.reserve(readings.sights.size() + readings.rangings.size());
  for (const Sight& sight : readings.sights) {
    const TeamPair ends = pair(interval, paths, sight.observer, sight.neighbor);
    const TeamCamera& camera = ends.observer.cameras[sight.camera];
    const auto model = SightModel::at(ends, camera, sight.time_s(interval), sight.sigma_rad());
    if (!model) continue;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    double count = 0.0;
    for (const Bearing* z : sight.bearings) {
      const auto residual =
          model->residual(ends, camera, z->u_B, to_seconds(z->stamp - interval.from));
      if (!residual) continue;
      sum += *residual;
      count += 1.0;
    }
    if (count == 0.0) continue;
    rows.push_back(model->row());
    rows.back().residual = sum / count;
  }
  for (const Ranging& ranging : readings.rangings) {
    const TeamPair ends = pair(interval, paths, ranging.observer, ranging.neighbor);
    const TeamRangeBias& bias = ranges_.at(ordered(ranging.observer, ranging.neighbor));
    const double spread = std::sqrt(static_cast<double>(ranging.ranges.size()));
    std::optional<TeamRow> mean;
    double sum_m = 0.0;
    double count = 0.0;
    for (const TeamRange* z : ranging.ranges) {
      const RangeReading weighed{z->reading.range_m, z->reading.sigma_m / spread};
      const auto row = range_row(ends, bias, weighed, to_seconds(z->stamp - interval.from),
                                 position_covariance(ranging.observer, ranging.neighbor));
      if (!row) continue;
      mean = *row;
      sum_m += row->residual.x();
      count += 1.0;
    }
    if (!mean) continue;
    mean->residual.x() = sum_m / count;
    if (associate(mean->covariance(P_)(0, 0), *mean)) rows.push_back(*mean);
  }
  return rows;
}

namespace {

/// Of a correction: turns [rad], and moves over the distance.
double largest_step(const std::map<RobotId, TeamRobot>& robots, const Eigen::VectorXd& dx) {
  double largest = 0.0;
  for (const auto& [id, robot] : robots) {
    for (const TeamCamera& camera : robot.cameras)
      largest = std::max(largest, dx.segment<3>(camera.index).norm());
    if (robot.motion_index < 0) continue;
    const double distance = std::max(robot.motion.p_F.norm(), kUnknownDistance);
    largest = std::max({largest, dx.segment<3>(robot.motion_index + 6).norm(),
                        dx.segment<3>(robot.motion_index).norm() / distance});
  }
  return largest;
}

}  // namespace

bool TeamFilter::correct(const TeamInterval& interval) {
  const double kept = std::exp(-to_seconds(interval.to - interval.from) / kAgreementMemory);
  for (auto& [id, robot] : robots_) {
    for (TeamCamera& camera : robot.cameras)
      for (auto& [neighbor, agreement] : camera.agreement) agreement.fade(kept);
  }
  for (auto& [pair, range] : ranges_)
    for (auto& [observer, agreement] : range.agreement) agreement.fade(kept);

  // Bearings come first: ranges may have gone through or around something, so that they are gated
  // by what the bearings leave open.
  for (const Stage stage : {Stage::kTrusted, Stage::kProbation}) {
    const Readings all = readings(interval, stage);
    if (!correct(interval, stage, {.sights = all.sights, .rangings = {}}) ||
        !correct(interval, stage, {.sights = {}, .rangings = all.rangings}))
      return false;
  }
  return P_.diagonal().minCoeff() > 0.0;
}

bool TeamFilter::correct(const TeamInterval& interval, Stage stage, Readings readings) {
  if (readings.sights.empty() && readings.rangings.empty()) return true;
  Trajectories paths = trajectories(interval);
  gate(interval, paths, readings);
  std::vector<TeamRow> linearized = rows(interval, paths, readings);
  const std::vector<bool> corrected = corrected_states(stage);
  const std::map<RobotId, TeamRobot> robots = robots_;
  const std::map<Pair, TeamRangeBias> ranges = ranges_;
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(P_.rows());
  for (int iteration = 1;; ++iteration) {
    if (linearized.empty()) {  // the last step may have made all ranges unlikely
      robots_ = robots;
      ranges_ = ranges;
      return true;
    }
    const TeamUpdate update(linearized, P_);
    if (!update.is_valid()) return false;
    Eigen::VectorXd next = update.correction(linearized, dx);
    for (Eigen::Index i = 0; i < next.size(); ++i)
      if (!corrected[static_cast<std::size_t>(i)]) next(i) = 0.0;
    const bool is_linear = largest_step(robots, next - dx) < kLinear;
    dx = next;
    robots_ = robots;
    ranges_ = ranges;
    inject(dx);
    if (is_linear || iteration == kMaxIterations) {
      update.correct(corrected, P_);
      break;
    }
    paths = trajectories(interval);
    linearized = rows(interval, paths, readings);
  }
  for (auto& [id, robot] : robots_) {
    if (robot.motion_index < 0) continue;
    const int theta = robot.motion_index + 6;
    const Eigen::Matrix3d J = so3_right_jacobian(dx.segment<3>(theta));
    P_.middleRows<3>(theta) = (J * P_.middleRows<3>(theta)).eval();
    P_.middleCols<3>(theta) = (P_.middleCols<3>(theta) * J.transpose()).eval();
  }
  return true;
}

/// Which states the readings of a stage correct: those of trusted robots, or of those on probation.
std::vector<bool> TeamFilter::corrected_states(Stage stage) const {
  std::vector<bool> corrected(static_cast<std::size_t>(P_.rows()), false);
  const auto mark = [&](int index, int count) {
    std::fill_n(corrected.begin() + index, count, true);
  };
  const auto is_corrected = [&](RobotId id) {
    return robots_.at(id).is_trusted == (stage == Stage::kTrusted);
  };
  for (const auto& [id, robot] : robots_) {
    if (!is_corrected(id)) continue;
    if (robot.motion_index >= 0) mark(robot.motion_index, kMotion);
    mark(robot.bias_index, TeamRobot::kCalibration);
    for (const TeamCamera& camera : robot.cameras) mark(camera.index, 3);
  }
  for (const auto& [pair, range] : ranges_) {
    const bool is_between_trusted =
        robots_.at(pair.first).is_trusted && robots_.at(pair.second).is_trusted;
    if (is_between_trusted == (stage == Stage::kTrusted)) mark(range.index, 1);
  }
  return corrected;
}

void TeamFilter::inject(const Eigen::VectorXd& dx) {
  for (auto& [id, robot] : robots_) {
    if (robot.motion_index >= 0) {
      const auto step = dx.segment<kMotion>(robot.motion_index);
      robot.motion.p_F += step.head<3>();
      robot.motion.v_F += step.segment<3>(3);
      robot.motion.q_F_B = (robot.motion.q_F_B * so3_exp(step.tail<3>())).normalized();
    }
    robot.bias.gyro_radps += dx.segment<3>(robot.bias_index);
    robot.bias.accel_mps2 += dx.segment<3>(robot.bias_index + 3);
    robot.bias.gyro_scale += dx.segment<9>(robot.bias_index + 6).reshaped<Eigen::ColMajor>(3, 3);
    robot.antenna_delay_m += dx(robot.delay_index());
    for (TeamCamera& camera : robot.cameras) camera.misalignment += dx.segment<3>(camera.index);
  }
  for (auto& [pair, range] : ranges_) range.bias_m += dx(range.index);
}

// With S this robot at the end of the interval, the new frame's motions are
//   p' = R_S^T (p - p_S),  v' = R_S^T (v - v_S),  R' = R_S^T R,
// and their errors  dp' = R_S^T (dp - dp_S) + [p']x dtheta_S,  dv' likewise,
// dtheta' = dtheta - R'^T dtheta_S.
void TeamFilter::advance(const TeamInterval& interval) {
  const Trajectories paths = trajectories(interval);
  const FreeMotionAt& self = paths.at(self_).end();
  const int self_bias = robots_.at(self_).bias_index;
  const Eigen::Matrix3d R_S_F = self.motion.R().transpose();
  struct Moved {
    int index = 0;
    int bias_index = 0;
    Eigen::Matrix<double, kMotion, kMotion> by_motion{};
    Eigen::Matrix<double, kMotion, kBias> by_bias{};
    Eigen::Matrix<double, kMotion, kBias> by_self_bias{};
    Eigen::Matrix<double, kMotion, kMotion> by_self{};  ///< by this robot's motion at the end
    Eigen::Matrix<double, kMotion, kMotion> noise{};
  };
  std::vector<Moved> all;
  for (auto& [id, robot] : robots_) {
    if (robot.motion_index < 0) continue;
    const FreeMotionAt& end = paths.at(id).end();
    FreeMotion next;
    next.p_F = R_S_F * (end.motion.p_F - self.motion.p_F);
    next.v_F = R_S_F * (end.motion.v_F - self.motion.v_F);
    next.q_F_B = (self.motion.q_F_B.conjugate() * end.motion.q_F_B).normalized();
    Moved moved{.index = robot.motion_index, .bias_index = robot.bias_index};
    Eigen::Matrix<double, kMotion, kMotion> turn =
        Eigen::Matrix<double, kMotion, kMotion>::Identity();
    turn.block<3, 3>(0, 0) = R_S_F;
    turn.block<3, 3>(3, 3) = R_S_F;
    moved.by_self.setZero();
    moved.by_self.block<3, 3>(0, 0) = -R_S_F;
    moved.by_self.block<3, 3>(3, 3) = -R_S_F;
    moved.by_self.block<3, 3>(0, 6) = hat(next.p_F);
    moved.by_self.block<3, 3>(3, 6) = hat(next.v_F);
    moved.by_self.block<3, 3>(6, 6) = -next.R().transpose();
    moved.by_motion = turn.lazyProduct(end.by_start.leftCols<kMotion>());
    moved.by_bias = turn.lazyProduct(end.by_start.rightCols<kBias>());
    moved.by_self_bias = moved.by_self.lazyProduct(self.by_start.rightCols<kBias>());
    const Eigen::Matrix<double, kMotion, kMotion> turned = turn.lazyProduct(end.noise);
    moved.noise = turned.lazyProduct(turn.transpose());
    robot.motion = next;
    all.push_back(moved);
  }
  for (const Moved& m : all) {
    P_.middleRows<kMotion>(m.index) = (m.by_motion * P_.middleRows<kMotion>(m.index) +
                                       m.by_bias * P_.middleRows<kBias>(m.bias_index) +
                                       m.by_self_bias * P_.middleRows<kBias>(self_bias))
                                          .eval();
  }
  for (const Moved& m : all) {
    P_.middleCols<kMotion>(m.index) = (P_.middleCols<kMotion>(m.index) * m.by_motion.transpose() +
                                       P_.middleCols<kBias>(m.bias_index) * m.by_bias.transpose() +
                                       P_.middleCols<kBias>(self_bias) * m.by_self_bias.transpose())
                                          .eval();
  }
  for (const Moved& a : all) {
    P_.block<kMotion, kMotion>(a.index, a.index) += a.noise;
    const Eigen::Matrix<double, kMotion, kMotion> of_self = a.by_self.lazyProduct(self.noise);
    for (const Moved& b : all)
      P_.block<kMotion, kMotion>(a.index, b.index) += of_self.lazyProduct(b.by_self.transpose());
  }

  const ProcessNoise& noise = interval.settings.noise;
  const double dt = to_seconds(interval.to - interval.from);
  for (auto& [id, robot] : robots_) {
    P_.diagonal().segment<3>(robot.bias_index).array() += noise.gyro_walk * noise.gyro_walk * dt;
    const double turning =
        interval.settings.priors.accel_scale * kGravityMps2 * turn_rate(*member_of(interval, id));
    P_.diagonal().segment<3>(robot.bias_index + 3).array() +=
        noise.accel_walk * noise.accel_walk * dt + turning * turning * kTurnMemory * dt;
  }
  const double kept_bias = std::exp(-noise.range_bias_return / (1.0 - kShareOfModules) * dt);
  for (auto& [pair, range] : ranges_) {
    range.bias_m *= kept_bias;
    P_.row(range.index) *= kept_bias;
    P_.col(range.index) *= kept_bias;
    P_(range.index, range.index) += noise.range_bias_walk * noise.range_bias_walk * dt;
  }
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  stamp_ = interval.to;
}

GaussianPose TeamFilter::known_pose(RobotId id) const {
  const TeamRobot& robot = robots_.at(id);
  GaussianPose pose{{robot.motion.p_F, robot.motion.q_F_B}};
  if (robot.motion_index < 0) return pose;
  // The covariance of [p, v, theta] without v.
  const std::array<Eigen::Index, 2> parts{robot.motion_index, robot.motion_index + 6};
  for (Eigen::Index a = 0; a < 2; ++a) {
    for (Eigen::Index b = 0; b < 2; ++b) {
      pose.covariance.block<3, 3>(3 * a, 3 * b) =
          P_.block<3, 3>(parts.at(std::size_t(a)), parts.at(std::size_t(b)));
    }
  }
  return pose;
}

namespace {

TeamPose distant_pose(RobotId id, const GaussianPose& T_S_N, const Eigen::Vector3d& v_S_N,
                      Timestamp stamp) {
  TeamPose pose{.neighbor = id, .T_B_N = T_S_N.pose, .v_B_N = v_S_N};
  pose.last_sighting = stamp;
  const Matrix6d& covariance = T_S_N.covariance;
  pose.covariance.topLeftCorner<3, 3>() = covariance.topLeftCorner<3, 3>();
  pose.covariance.topRightCorner<3, 3>() = covariance.topRightCorner<3, 3>();
  pose.covariance.bottomLeftCorner<3, 3>() = covariance.bottomLeftCorner<3, 3>();
  pose.covariance.bottomRightCorner<3, 3>() = covariance.bottomRightCorner<3, 3>();
  pose.covariance.diagonal().segment<3>(3).setConstant(kStartSpeed * kStartSpeed);
  return pose;
}

ImuBiasEstimate unknown_bias(RobotId id, const Priors& priors) {
  ImuBiasEstimate bias{.robot = id};
  bias.gyro_sigma_radps = priors.gyro_bias_radps;
  bias.accel_sigma_mps2 = std::sqrt(accel_bias_variance(priors));
  return bias;
}

}  // namespace

/// Robots that estimates connect to a known one, the most certain first. When the filter is full,
/// the others are located by their chain of estimates alone.
void TeamFilter::add_members(const TeamInterval& interval, TeamSolution& solution) {
  struct Place {
    GaussianPose T_S_N;
    Eigen::Vector3d v_S_N = Eigen::Vector3d::Zero();
  };
  std::map<RobotId, Place> places;
  std::map<RobotId, Place> candidates;
  const auto add_candidates_from = [&](RobotId known) {
    const Place& via = places.at(known);
    for (const RelativePoseEdge& edge : interval.edges) {
      const bool forward = edge.from == known;
      const RobotId id = forward ? edge.to : edge.from;
      if ((!forward && edge.to != known) || places.contains(id) ||
          member_of(interval, id) == nullptr || !is_usable(edge))
        continue;
      GaussianPose step = forward ? edge.T_from_to : inverse(edge.T_from_to);
      // What a peer estimated is not believed to be better, whatever it claims.
      if (edge.from != self_) step.covariance += start_floor();
      const Eigen::Vector3d v =
          forward ? edge.v_from_to
                  : Eigen::Vector3d(-(edge.T_from_to.pose.R().transpose() * edge.v_from_to));
      const Place place{via.T_S_N * step, via.v_S_N + via.T_S_N.pose.R() * v};
      const auto [best, is_first] = candidates.try_emplace(id, place);
      if (!is_first && place.T_S_N.covariance.trace() < best->second.T_S_N.covariance.trace())
        best->second = place;
    }
  };
  for (const auto& [id, robot] : robots_) places[id] = {known_pose(id), robot.motion.v_F};
  for (const auto& [id, robot] : robots_) add_candidates_from(id);
  while (!candidates.empty()) {
    const auto best = std::ranges::min_element(candidates, {}, [](const auto& candidate) {
      return candidate.second.T_S_N.covariance.trace();
    });
    const auto [id, place] = *best;
    candidates.erase(best);
    places[id] = place;
    if (robots_.size() < interval.settings.max_robots) {
      add_member(interval, id, place.T_S_N, place.v_S_N);
    } else if (!has_own_edge(interval, id)) {
      // A pair's filter would know it better than a chain of estimates.
      solution.poses.push_back(distant_pose(id, place.T_S_N, place.v_S_N, stamp_));
      solution.biases.push_back(unknown_bias(id, interval.settings.priors));
    }
    add_candidates_from(id);
  }
}

void TeamFilter::add_member(const TeamInterval& interval, RobotId id, const GaussianPose& T_S_N,
                            const Eigen::Vector3d& v_S_N) {
  TeamRobot& robot = robots_[id];
  robot.motion = {T_S_N.pose.p, v_S_N, T_S_N.pose.q};
  const double doubt = std::pow(kDoubtPerLoss, std::min(recent_losses(id), 2));
  robot.motion_index = append(kMotion, doubt * kStartSpeed);
  auto block = P_.bottomRightCorner<kMotion, kMotion>();
  const Matrix6d& covariance = T_S_N.covariance;
  const double turn = is_realigned(id) ? kUnknownAlignment : 0.0;
  block.topLeftCorner<3, 3>() = covariance.topLeftCorner<3, 3>();
  block.topLeftCorner<3, 3>().diagonal().array() += std::pow(doubt * kStartPosition, 2);
  block.topRightCorner<3, 3>() = covariance.topRightCorner<3, 3>();
  block.bottomLeftCorner<3, 3>() = covariance.bottomLeftCorner<3, 3>();
  block.bottomRightCorner<3, 3>() = covariance.bottomRightCorner<3, 3>();
  block.bottomRightCorner<3, 3>().diagonal().array() +=
      std::pow(doubt * kStartAttitude, 2) + turn * turn;
  robot.bias_index = append_calibration(interval.settings.priors);
  robot.last_sighting = stamp_;
  robot.since = stamp_;
}

void TeamFilter::report(const TeamInterval& interval, TeamSolution& solution) const {
  for (const auto& [id, robot] : robots_) {
    const auto sigma = [&](int index) { return std::sqrt(P_.diagonal().segment<3>(index).mean()); };
    solution.biases.push_back({id, robot.bias.gyro_radps, robot.bias.accel_mps2,
                               robot.bias.gyro_scale, sigma(robot.bias_index),
                               sigma(robot.bias_index + 3)});
    // On probation it is known worse than by its pair's filter, if there is one.
    if (robot.motion_index < 0 || (!robot.is_trusted && has_own_edge(interval, id))) continue;
    solution.poses.push_back(
        {.neighbor = id,
         .T_B_N = {robot.motion.p_F, robot.motion.q_F_B},
         .v_B_N = robot.motion.v_F,
         .covariance = P_.block<kMotion, kMotion>(robot.motion_index, robot.motion_index),
         .last_sighting = robot.last_sighting});
  }
  std::ranges::sort(solution.poses, {}, &TeamPose::neighbor);
  for (const auto& [id, robot] : robots_) {
    report_cameras(interval, id, solution);
    report_ranges(id, solution);
  }
}

void TeamFilter::report_cameras(const TeamInterval& interval, RobotId id,
                                TeamSolution& solution) const {
  for (const TeamCamera& camera : robots_.at(id).cameras) {
    const double angle = camera.misalignment.norm();
    const double sigma = std::sqrt(P_.diagonal().segment<3>(camera.index).maxCoeff());
    if (camera.is_refused) {
      solution.faults.push_back({id, TeamFault::Kind::kCameraRefused, angle});
    } else if (angle > largest_misalignment(interval.settings.priors) &&
               angle > kWrongSigmas * sigma) {
      solution.faults.push_back({id, TeamFault::Kind::kCameraTurned, angle});
    }
  }
}

/// A robot most of whose ranges, to at least two others, are refused.
void TeamFilter::report_ranges(RobotId id, TeamSolution& solution) const {
  int measured = 0;
  int contradicted = 0;
  double sum_m = 0.0;
  for (const auto& [pair, range] : ranges_) {
    const auto agreement = range.agreement.find(id);
    if (agreement == range.agreement.end()) continue;
    measured += agreement->second.fused + agreement->second.gated > 1.0 ? 1 : 0;
    if (!agreement->second.is_contradiction()) continue;
    ++contradicted;
    sum_m += range.refused_m.at(id);
  }
  if (contradicted >= 2 && 2 * contradicted > measured)
    solution.faults.push_back({id, TeamFault::Kind::kRanges, sum_m / contradicted});
}

}  // namespace crepes
