#include "estimator/team/trust/gyro_check.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "estimator/core/quantile.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/readings/reading_scene.hpp"
#include "estimator/team/readings/team_measurement.hpp"

namespace crepes {
namespace {

constexpr double kLeastTime = 0.02;  // s; between the halves
constexpr double kUnlikely = 12.0;   // chi-square of two degrees; one right sight in 400
constexpr double kExplained = 0.8;   // of the sum of all sights' chi-squares
constexpr double kAnyTurn = 1.0;     // rad; sigma of a camera's turn
constexpr double kAnyRate = 30.0;    // rad/s; sigma of a rate of which nothing is known

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix32 = Eigen::Matrix<double, 3, 2>;

/// A direction in one half of an interval.
struct Direction {
  Eigen::Vector3d predicted;
  Eigen::Vector3d measured;
  Matrix32 across;  ///< the predicted one

  /// In the plane across, if the camera is turned by `R`.
  [[nodiscard]] Eigen::Vector2d residual(const Eigen::Matrix3d& R) const {
    return angles_across(predicted, across, R.transpose() * measured);
  }
  /// Of the residual, by a turn of the camera.
  [[nodiscard]] Matrix23 by_turn() const { return across.transpose() * hat(predicted); }
};

/// A direction in both halves, with what the belief does not know of it.
struct Change {
  Direction first;
  Direction second;
  Eigen::Matrix2d turn;              ///< from the second's plane to the first's
  Eigen::Matrix2d first_covariance;  ///< of the first's residual
  Eigen::Matrix2d covariance;        ///< of the difference of the residuals
  double time_s = 0.0;               ///< between the halves
  bool may_be_leap = false;          ///< it is clear, and may have happened at once

  [[nodiscard]] Eigen::Vector2d residual(const Eigen::Matrix3d& R) const {
    return turn * second.residual(R) - first.residual(R);
  }
  /// A turned camera sees other changes, too.
  [[nodiscard]] Matrix23 by_turn() const { return turn * second.by_turn() - first.by_turn(); }
  /// By the observer's rate of rotation, beyond what its gyroscope reads.
  [[nodiscard]] Matrix23 by_rate() const { return time_s * turn * second.by_turn(); }
};

/// A vector of three components from residuals.
struct LeastSquares {
  Eigen::Matrix3d information;
  Eigen::Vector3d weighed = Eigen::Vector3d::Zero();

  explicit LeastSquares(double prior_sigma)
      : information(Eigen::Matrix3d::Identity() / (prior_sigma * prior_sigma)) {}
  void add(const Eigen::Vector2d& residual, const Eigen::Matrix2d& covariance, const Matrix23& by) {
    const Matrix32 gain = covariance.llt().solve(by).transpose();
    information += gain * by;
    weighed += gain * residual;
  }
  [[nodiscard]] Eigen::Vector3d mean() const { return information.ldlt().solve(weighed); }
};

/// Half of a sight's bearings.
struct Half {
  std::span<const Bearing* const> bearings;

  [[nodiscard]] double time_s(Timestamp from) const {
    double sum_s = 0.0;
    for (const Bearing* z : bearings) sum_s += to_seconds(z->stamp - from);
    return sum_s / static_cast<double>(bearings.size());
  }
};

/// The median in each component, so that single false bearings do not count.
std::optional<Eigen::Vector2d> median_residual(const TeamPair& pair, const TeamCamera& camera,
                                               const SightModel& model, const Half& half,
                                               Timestamp from) {
  std::vector<double> x;
  std::vector<double> y;
  for (const Bearing* z : half.bearings) {
    const auto residual = model.residual(pair, camera, z->u_B, to_seconds(z->stamp - from));
    if (!residual) return std::nullopt;
    x.push_back(residual->x());
    y.push_back(residual->y());
  }
  return Eigen::Vector2d(upper_median(x), upper_median(y));
}

Direction direction_of(const SightModel& model, const Eigen::Vector2d& residual) {
  const double angle = residual.norm();
  const double sinc = angle < 1e-9 ? 1.0 : std::sin(angle) / angle;
  return {.predicted = model.predicted(),
          .measured = std::cos(angle) * model.predicted() + sinc * (model.across() * residual),
          .across = model.across()};
}

/// Of what a gyroscope reads, by its biases and scale errors.
Eigen::Matrix3d rate_covariance(const TeamBelief& belief, const TeamRobot& robot,
                                const TeamMember& member) {
  Eigen::Vector4d by = Eigen::Vector4d::Unit(0);
  for (const ImuMean& mean : member.imu)
    by.tail<3>() += mean.gyro_radps / static_cast<double>(member.imu.size());
  constexpr std::array<int, 4> kParts{0, 6, 9, 12};  // the bias, and the scale's columns
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t a = 0; a < kParts.size(); ++a) {
    for (std::size_t b = 0; b < kParts.size(); ++b) {
      covariance +=
          by(Eigen::Index(a)) * by(Eigen::Index(b)) *
          belief.P.block<3, 3>(robot.bias_index + kParts[a], robot.bias_index + kParts[b]);
    }
  }
  return covariance;
}

/// Whether a change at this rate would be clear from one bearing to the next, and none is there or
/// one of them stands still.
bool may_be_leap(const TeamPair& pair, const TeamCamera& camera, const SightModel& model,
                 std::span<const Bearing* const> bearings, double rate_radps, Timestamp from) {
  constexpr double kClear = 8.0;  // sigmas
  constexpr double kStill = 0.5;  // of what the rate turns
  bool is_clear = false;
  bool is_gradual = bearings.size() > 2;
  for (std::size_t i = 1; i < bearings.size(); ++i) {
    const Bearing& before = *bearings[i - 1];
    const Bearing& after = *bearings[i];
    const double expected = rate_radps * to_seconds(after.stamp - before.stamp);
    if (expected < kClear * after.sigma_rad) continue;
    const auto r1 = model.residual(pair, camera, before.u_B, to_seconds(before.stamp - from));
    const auto r2 = model.residual(pair, camera, after.u_B, to_seconds(after.stamp - from));
    is_clear = true;
    is_gradual = is_gradual && r1 && r2 && (*r2 - *r1).norm() > kStill * expected;
  }
  return is_clear && !is_gradual;
}

std::optional<Change> change_of(const ReadingScene& scene, const Sight& sight) {
  const std::size_t count = sight.bearings.size() / 2;
  if (count == 0) return std::nullopt;
  std::vector<const Bearing*> sorted = sight.bearings;
  std::ranges::stable_sort(sorted, {}, &Bearing::stamp);
  // An ID seen twice at once is a robot and its mirror image: either may be lost from view.
  if (std::ranges::adjacent_find(sorted, {}, &Bearing::stamp) != sorted.end()) return std::nullopt;
  const std::span all(sorted);
  const Half first{all.first(count)};
  const Half second{all.last(count)};
  const Timestamp from = scene.interval.from;
  const double t1_s = first.time_s(from);
  const double t2_s = second.time_s(from);
  if (t2_s - t1_s < kLeastTime) return std::nullopt;

  const TeamPair pair = scene.pair(sight.observer, sight.neighbor);
  const TeamCamera& camera = pair.observer.cameras[sight.camera];
  const auto before = SightModel::at(pair, camera, t1_s, sight.sigma_rad());
  const auto after = SightModel::at(pair, camera, t2_s, sight.sigma_rad());
  if (!before || !after) return std::nullopt;
  const auto r1 = median_residual(pair, camera, *before, first, from);
  const auto r2 = median_residual(pair, camera, *after, second, from);
  if (!r1 || !r2) return std::nullopt;

  const Eigen::Matrix3d R =
      shortest_rotation(after->predicted(), before->predicted()).toRotationMatrix();
  const Eigen::Matrix2d turn = before->across().transpose() * R * after->across();
  TeamRow row = after->row();
  row.H.leftCols(row.size) =
      (turn * row.H.leftCols(row.size)).eval() - before->row().H.leftCols(row.size);
  row.variance += before->row().variance;
  Change change{.first = direction_of(*before, *r1),
                .second = direction_of(*after, *r2),
                .turn = turn,
                .first_covariance = before->row().covariance(scene.instant.covariance()),
                .covariance = row.covariance(scene.instant.covariance()),
                .time_s = t2_s - t1_s};
  const double rate_radps = change.residual(Eigen::Matrix3d::Identity()).norm() / change.time_s;
  change.may_be_leap = may_be_leap(pair, camera, *before, all, rate_radps, from);
  // The instant has no part of the gyroscope's errors from the first half to the second.
  change.covariance += change.by_rate() *
                       rate_covariance(scene.belief, pair.observer, pair.observer_member) *
                       change.by_rate().transpose();
  return change;
}

/// The turn of the camera that explains the first half.
struct CameraTurn {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d covariance;

  explicit CameraTurn(std::span<const Change> changes) {
    constexpr int kIterations = 3;
    for (int iteration = 0; iteration < kIterations; ++iteration) {
      LeastSquares turn(kAnyTurn);
      for (const Change& change : changes)
        turn.add(change.first.residual(R), change.first_covariance, change.first.by_turn());
      covariance = turn.information.inverse();
      // A camera turned by m sees Exp(m) u; by_turn is the derivative by the observer's turn.
      R = R * so3_exp(-turn.mean()).toRotationMatrix();
    }
  }
};

/// What one robot's cameras see, against its gyroscope.
struct Evidence {
  double chi2 = 0.0;
  double explained = 0.0;  ///< of `chi2`, by another rate
  double rate_radps = 0.0;
  std::ptrdiff_t sights = 0;
  std::ptrdiff_t unlikely = 0;  ///< of the sights
  std::ptrdiff_t leaps = 0;     ///< of these, as it seems

  [[nodiscard]] bool is_explained() const { return explained > kExplained * chi2; }
};

Evidence evidence_of(std::span<const Change> changes) {
  const CameraTurn turn(changes);
  Evidence evidence{.sights = std::ssize(changes)};
  LeastSquares rate(kAnyRate);
  for (const Change& change : changes) {
    const Eigen::Vector2d residual = change.residual(turn.R);
    const Matrix23 by_turn = change.by_turn();
    const Eigen::Matrix2d S = change.covariance + by_turn * turn.covariance * by_turn.transpose();
    const double chi2 = residual.dot(S.llt().solve(residual));
    evidence.unlikely += chi2 > kUnlikely ? 1 : 0;
    evidence.leaps += chi2 > kUnlikely && change.may_be_leap ? 1 : 0;
    evidence.chi2 += chi2;
    rate.add(residual, S, change.by_rate());
  }
  const Eigen::Vector3d mean = rate.mean();
  evidence.explained = rate.weighed.dot(mean);
  evidence.rate_radps = mean.norm();
  return evidence;
}

/// Whether a robot's bearings to another one agreed with its place until now.
bool has_agreed(const TeamBelief& belief, RobotId observer, RobotId neighbor) {
  constexpr double kAgreed = 2.0;  // times what contradicts
  Agreement all;
  for (const TeamCamera& camera : belief.robots.at(observer).cameras) {
    const auto one = camera.agreement.find(neighbor);
    if (one == camera.agreement.end()) continue;
    all.fused += one->second.fused;
    all.gated += one->second.gated;
  }
  return all.fused > 4.0 && all.fused > kAgreed * all.gated;
}

/// What one robot sees.
struct Seen {
  std::vector<Change> changes;
  std::set<RobotId> neighbors;
  bool are_trusted = false;  ///< these neighbors
  Evidence evidence;

  /// Of robots that have just been placed, anything is likely: they count where no others are seen.
  void add(const Change& change, RobotId neighbor, bool is_trusted) {
    if (is_trusted && !are_trusted) {
      changes.clear();
      neighbors.clear();
    }
    if (are_trusted && !is_trusted) return;
    are_trusted = is_trusted;
    changes.push_back(change);
    neighbors.insert(neighbor);
  }
};
using SeenByAll = std::map<RobotId, Seen>;

SeenByAll seen_by_all(const TeamInterval& interval, const TeamTrajectories& paths,
                      const TeamBelief& belief) {
  const TeamInstant instant(belief, paths, 0.5 * to_seconds(interval.to - interval.from));
  const ReadingScene scene{interval, paths, instant, belief};
  SeenByAll all;
  for (const Sight& sight : all_sights(interval, belief)) {
    const auto change = change_of(scene, sight);
    if (!change) continue;
    all[sight.observer].add(*change, sight.neighbor, belief.robots.at(sight.neighbor).is_trusted);
  }
  for (auto& [robot, seen] : all) seen.evidence = evidence_of(seen.changes);
  return all;
}

/// Most of the robots that it sees, and at least two, change their directions unexpectedly.
bool is_common(const Evidence& evidence) {
  return evidence.unlikely >= 2 && 2 * evidence.unlikely > evidence.sights;
}

/// The only robot that it sees does so. That one moves as it is believed to, since it sees this
/// robot where it expects it, and it is no mirror image.
bool is_single(const TeamBelief& belief, const SeenByAll& all, RobotId robot) {
  const Seen& seen = all.at(robot);
  if (seen.evidence.sights != 1 || seen.evidence.unlikely != 1) return false;
  const RobotId only = *seen.neighbors.begin();
  const auto back = all.find(only);
  return back != all.end() && back->second.neighbors.contains(robot) &&
         back->second.evidence.unlikely == 0 && has_agreed(belief, robot, only);
}

}  // namespace

std::map<RobotId, GyroCheck> gyro_checks(const TeamInterval& interval,
                                         const TeamTrajectories& paths, const TeamBelief& belief) {
  const SeenByAll all = seen_by_all(interval, paths, belief);
  std::map<RobotId, GyroCheck> checks;
  for (const auto& [robot, seen] : all) {
    const Evidence& evidence = seen.evidence;
    GyroCheck& check = checks[robot];
    check.chi2 = evidence.chi2;
    check.dimension = 2 * static_cast<int>(evidence.sights);
    check.is_confirmed =
        evidence.unlikely == 0 && seen.are_trusted && belief.robots.at(robot).is_trusted;
    const bool is_only_one = is_single(belief, all, robot);
    if (evidence.is_explained() && (is_common(evidence) || is_only_one)) {
      check.contradiction = {.chi2 = evidence.explained,
                             .rate_radps = evidence.rate_radps,
                             .may_be_leap = is_only_one || 2 * evidence.leaps > evidence.unlikely};
    }
  }
  return checks;
}

}  // namespace crepes
