#include "estimator/swarm/imu_mounting.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A turn is long enough to exceed the noise of the bearings, and short enough to be small.
constexpr Duration kShortestTurn = std::chrono::milliseconds{100};
constexpr Duration kLongestTurn = std::chrono::milliseconds{300};
constexpr Duration kUncovered = std::chrono::milliseconds{20};  // by samples
constexpr Duration kAtOnce = std::chrono::milliseconds{100};
constexpr Duration kClockStep = std::chrono::seconds{1};  // back; repeated bearings are newer
constexpr Duration kJudgment = std::chrono::milliseconds{500};
// Forgetting, 1/s: what is old of a robot that turns, and nothing of one that does not.
constexpr double kForget = 0.05;
constexpr double kForgetRecent = 0.5;
constexpr double kTurning = 0.1;  // rad/s
// What two robots' motion adds to a turn, and accelerations to an elevation.
constexpr double kTurnSigma = 0.05;        // rad
constexpr double kElevationSigma = 0.3;    // of its sine
constexpr double kBearingVariance = 1e-5;  // of a turn, by noise [rad^2]
// A rotation is found if it explains this much of so many turns [rad^2], and this many times better
// than none; less will do if elevations agree with it alone. Within a second, another robot's
// motion may look like anything. Elevations are root mean squares of the sum of both sines.
constexpr double kLeastCount = 30.0;
constexpr double kLeastTurns = 0.02;
constexpr double kMuchBetter = 3.0;
constexpr double kBetter = 1.7;
constexpr double kLeastAngle = 20.0 / kDegPerRad;
constexpr double kLeastElevations = 3.0;
constexpr double kPlausibleElevation = 0.25;
constexpr double kImplausibleElevation = 0.3;
constexpr double kLeastExclusion = 0.002;  // rad^2

/// The 24 rotations that exchange axes. Boards are mounted so, or nearly so.
std::vector<Matrix3d> right_angles() {
  std::vector<Matrix3d> all;
  std::array<int, 3> axes{0, 1, 2};
  do {
    for (unsigned signs = 0; signs < 8; ++signs) {
      Matrix3d R = Matrix3d::Zero();
      for (unsigned i = 0; i < 3; ++i)
        R(static_cast<int>(i), axes.at(i)) = (signs & 1U << i) != 0 ? -1.0 : 1.0;
      if (R.determinant() > 0.0) all.push_back(R);
    }
  } while (std::ranges::next_permutation(axes).found);
  return all;
}

}  // namespace

void MountingEvidence::Squares::add(const Row& row, double value) {
  M += row.transpose() * row;
  b += value * row.transpose();
  c += value * value;
}

void MountingEvidence::Squares::fade(double kept) {
  M *= kept;
  b *= kept;
  c *= kept;
  count *= kept;
}

double MountingEvidence::Squares::at(const Matrix3d& R) const {
  const Elements r = R.reshaped();
  return std::max(0.0, r.dot(M * r) - 2.0 * b.dot(r) + c);
}

double MountingEvidence::Squares::root_mean(const Matrix3d& R) const {
  return std::sqrt(at(R) / count);
}

void MountingEvidence::add_turn(const Vector3d& before, const Vector3d& after,
                                const Vector3d& theta) {
  const Matrix3d by_turn = hat((before + after).normalized());
  const Vector3d change = after - before;
  for (int i = 0; i < 3; ++i) {
    const Row row = (by_turn.row(i).transpose() * theta.transpose()).reshaped().transpose();
    turns_.add(row, change(i));
  }
  turns_.count += 1.0;
}

void MountingEvidence::add_elevation(const Vector3d& u, const Vector3d& up, double sine) {
  elevations_.add((u * up.transpose()).reshaped().transpose(), -sine);
  elevations_.count += 1.0;
}

void MountingEvidence::fade(double kept) {
  turns_.fade(kept);
  elevations_.fade(kept);
}

/// Gauss and Newton's method from all right angles.
Matrix3d MountingEvidence::likeliest() const {
  constexpr int kIterations = 8;
  static const std::vector<Matrix3d> starts = right_angles();
  constexpr double kTurnWeight = 1.0 / (kTurnSigma * kTurnSigma);
  constexpr double kElevationWeight = 1.0 / (kElevationSigma * kElevationSigma);
  const Information M = kTurnWeight * turns_.M + kElevationWeight * elevations_.M;
  const Elements b = kTurnWeight * turns_.b + kElevationWeight * elevations_.b;
  const auto cost = [&](const Matrix3d& R) {
    const Elements r = R.reshaped();
    return r.dot(M * r) - 2.0 * b.dot(r);
  };
  Matrix3d best = Matrix3d::Identity();
  for (Matrix3d R : starts) {
    for (int i = 0; i < kIterations; ++i) {
      Eigen::Matrix<double, 9, 3> J;
      for (int axis = 0; axis < 3; ++axis) J.col(axis) = (hat(Vector3d::Unit(axis)) * R).reshaped();
      Matrix3d H = J.transpose() * M * J;
      H.diagonal().array() += 1.0;  // about axes that nothing shows, it stays at the right angle
      const Vector3d step = -H.llt().solve(J.transpose() * (M * R.reshaped() - b));
      R = so3_exp(step) * R;
    }
    if (cost(R) < cost(best)) best = R;
  }
  return best;
}

std::optional<Matrix3d> MountingEvidence::rotation() const {
  const double unexplained = turns_.at(Matrix3d::Identity());
  if (turns_.count < kLeastCount || unexplained < kLeastTurns ||
      elevations_.count < kLeastElevations)
    return std::nullopt;
  const Matrix3d R = likeliest();
  const double rest = turns_.at(R) + kBearingVariance * turns_.count;
  const double elevation = elevations_.root_mean(R);
  const double without = elevations_.root_mean(Matrix3d::Identity());
  const bool is_level = without > kImplausibleElevation && elevation < 0.5 * without;
  const bool neighbors_turn_along = turns_.at(Matrix3d::Zero()) < kBetter * rest;
  const bool is_found = !neighbors_turn_along && unexplained - rest > kLeastTurns &&
                        unexplained > (is_level ? kBetter : kMuchBetter) * rest &&
                        elevation < kPlausibleElevation &&
                        Eigen::AngleAxisd(R).angle() > kLeastAngle;
  return is_found ? std::optional(R) : std::nullopt;
}

bool MountingEvidence::excludes(const Matrix3d& R) const {
  return turns_.at(R) - turns_.at(Matrix3d::Identity()) >
         kLeastExclusion + kBearingVariance * turns_.count;
}

void ImuMounting::add(RobotId observer, const Bearing& bearing, const ImuHistory& imu) {
  if (imu.empty()) return;
  Robot& robot = robots_[observer];
  const auto [found, is_first] = robot.bearings.try_emplace(bearing.neighbor, bearing);
  if (bearing.stamp < found->second.stamp - kClockStep) {
    robot = {};
    return;
  }
  if (is_first || bearing.stamp - found->second.stamp < kShortestTurn) return;
  const Bearing before = std::exchange(found->second, bearing);
  if (bearing.stamp - before.stamp > kLongestTurn || bearing.p_B_C != before.p_B_C ||
      imu.extrapolated(before.stamp, bearing.stamp) > kUncovered)
    return;
  const double duration_s = to_seconds(bearing.stamp - before.stamp);
  const Vector3d theta = so3_log(imu.rotation(before.stamp, bearing.stamp));
  const Vector3d up = imu.mean(before.stamp, bearing.stamp).accel_mps2.normalized();

  if (robot.newest == kNever) robot.newest = robot.judged = bearing.stamp;
  if (bearing.stamp > robot.newest) {
    const double passed_s = to_seconds(bearing.stamp - robot.newest);
    const double turning = std::min(1.0, theta.norm() / duration_s / kTurning);
    robot.evidence.fade(std::exp(-kForget * turning * turning * passed_s));
    robot.recent.fade(std::exp(-kForgetRecent * passed_s));
    robot.newest = bearing.stamp;
  }
  robot.elevations[bearing.neighbor] = {bearing.stamp, up.dot(bearing.u_B)};
  for (MountingEvidence* const evidence : {&robot.evidence, &robot.recent})
    evidence->add_turn(before.u_B, bearing.u_B, theta);
  if (const auto neighbor = robots_.find(bearing.neighbor); neighbor != robots_.end()) {
    const auto its = neighbor->second.elevations.find(observer);
    if (its != neighbor->second.elevations.end() &&
        std::chrono::abs(bearing.stamp - its->second.stamp) < kAtOnce)
      robot.evidence.add_elevation(bearing.u_B, up, its->second.sine);
  }
  if (robot.newest - robot.judged < kJudgment) return;
  robot.judged = robot.newest;
  judge(robot);
}

void ImuMounting::judge(Robot& robot) {
  if (!robot.rotation) {
    robot.rotation = robot.evidence.rotation();
  } else if (robot.recent.excludes(*robot.rotation)) {
    robot.rotation.reset();
    robot.evidence = {};
  }
}

bool ImuMounting::is_wrong(RobotId robot) const {
  const auto found = robots_.find(robot);
  return found != robots_.end() && found->second.rotation.has_value();
}

std::optional<TeamFault> ImuMounting::fault_of(RobotId robot) const {
  if (!is_wrong(robot)) return std::nullopt;
  return TeamFault{robot, TeamFault::Kind::kMounting,
                   Eigen::AngleAxisd(*robots_.at(robot).rotation).angle()};
}

}  // namespace crepes
