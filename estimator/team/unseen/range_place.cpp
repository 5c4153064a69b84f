#include "estimator/team/unseen/range_place.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numbers>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/team/unseen/range_fit.hpp"

namespace crepes {
namespace {

constexpr std::size_t kLeastTrack = 10;         // intervals with enough ranges
constexpr double kMostPosition = 0.7;           // m; sigma of its place
constexpr double kMostAttitude = radians(8.0);  // rad; sigma about any axis
constexpr double kClearChi2 = 25.0;             // by which another place is less likely
constexpr double kNear = 1.0;                   // m
constexpr double kNearAttitude = radians(15.0);

bool is_certain(const TeamPlace& place) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> attitude(
      place.covariance.bottomRightCorner<3, 3>());
  return place.covariance.topLeftCorner<3, 3>().trace() <= kMostPosition * kMostPosition &&
         attitude.eigenvalues()(0) > 0.0 &&
         attitude.eigenvalues()(2) <= kMostAttitude * kMostAttitude;
}

/// False if the other place is not near this one.
bool contain(const TeamPlace& other, TeamPlace& place) {
  const Vector6d d = pose_difference(place.T_S_N, other.T_S_N);
  if (d.head<3>().norm() > kNear || d.tail<3>().norm() > kNearAttitude) return false;
  Eigen::Matrix<double, FreeMotionAt::kMotion, 1> step;
  step << d.head<3>(), other.v_S_N - place.v_S_N, d.tail<3>();
  place.covariance += step * step.transpose();
  return true;
}

}  // namespace

std::optional<TeamPlace> place_by_ranges(const std::deque<UnseenInterval>& intervals,
                                         const RangeProblemSettings& settings) {
  const RangeProblem problem(intervals, settings);
  if (problem.spheres.size() < kLeastTrack) return std::nullopt;
  std::vector<RangeFit> fits;
  for (const double side : {1.0, -1.0})
    fits.emplace_back(problem, range_track(problem.spheres, side), std::nullopt);
  const RangeFit first = *std::ranges::min_element(fits, {}, &RangeFit::cost);
  if (!first.is_consistent() || !is_certain(first.place())) return std::nullopt;
  // Both may have ended on the same side of the beacons, or with the same wrong heading.
  fits.emplace_back(problem, mirrored(first.track(), problem.spheres), std::nullopt);
  for (const double quarter : {1.0, 2.0, 3.0})
    fits.emplace_back(problem, first.track(), first.turned(0.5 * std::numbers::pi * quarter));
  const RangeFit& best = *std::ranges::min_element(fits, {}, &RangeFit::cost);
  if (!best.is_consistent()) return std::nullopt;
  TeamPlace place = best.place();
  for (const RangeFit& fit : fits) {
    if (&fit != &best && fit.cost() <= best.cost() + kClearChi2 && !contain(fit.place(), place))
      return std::nullopt;
  }
  return is_certain(place) ? std::optional(place) : std::nullopt;
}

}  // namespace crepes
