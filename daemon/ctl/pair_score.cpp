#include "daemon/ctl/pair_score.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace crepes {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Duration kPeriod = std::chrono::milliseconds(20);

/// The grid instant closest to `t`, counted from `origin`.
std::int64_t instant_of(Timestamp t, Timestamp origin) {
  const auto half = kPeriod / 2;
  const Duration shifted = t - origin + half;
  const std::int64_t quotient = shifted / kPeriod;
  return shifted % kPeriod < Duration::zero() ? quotient - 1 : quotient;
}

/// Instants `origin + k 20 ms` inside the window that have a row, of all. The first row gives the
/// grid its phase.
double availability_of(std::span<const NeighborPose> inside, const ScoreWindow& window) {
  if (inside.empty() || window.end < window.begin) return 0.0;
  const Timestamp origin = inside.front().stamp;
  const std::int64_t before = (origin - window.begin) / kPeriod;
  const std::int64_t after = (window.end - origin) / kPeriod;
  std::int64_t present = 0;
  std::optional<std::int64_t> last;
  for (const NeighborPose& pose : inside) {
    const std::int64_t instant = instant_of(pose.stamp, origin);
    if (instant <= after && instant != last) ++present;
    last = instant;
  }
  return static_cast<double>(present) / static_cast<double>(before + 1 + after);
}

}  // namespace

double median_of(std::vector<double> values) {
  if (values.empty()) return kNaN;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2.0;
}

ErrorStatistics statistics_of(std::vector<double> errors) {
  if (errors.empty()) return {kNaN, kNaN, kNaN, kNaN};
  const auto n = static_cast<double>(errors.size());
  const double squares = std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0);
  const double sum = std::accumulate(errors.begin(), errors.end(), 0.0);
  const double max = *std::max_element(errors.begin(), errors.end());
  return {std::sqrt(squares / n), sum / n, median_of(std::move(errors)), max};
}

PairScore score_pair(std::span<const NeighborPose> poses, const RelativeTruth& truth,
                     Timestamp start, const ScoreWindow& window) {
  PairScore score;
  if (!poses.empty()) score.first_row = poses.front().stamp - start;
  const auto earlier = [](const NeighborPose& pose, Timestamp t) { return pose.stamp < t; };
  const auto later = [](Timestamp t, const NeighborPose& pose) { return t < pose.stamp; };
  const auto first = std::lower_bound(poses.begin(), poses.end(), window.begin, earlier);
  const auto last = std::upper_bound(first, poses.end(), window.end, later);
  const std::span<const NeighborPose> inside(first, last);

  score.rows = inside.size();
  score.availability = availability_of(inside, window);
  std::vector<double> nees;
  for (const NeighborPose& pose : inside) {
    ++score.modes.at(static_cast<std::size_t>(pose.mode));
    score.max_age = std::max(score.max_age, pose.published - pose.stamp);
    const std::optional<Pose> T_B_N = truth(pose.stamp);
    if (!T_B_N) continue;
    const Vector6d d = pose_difference(pose.T_B_N.pose, *T_B_N);
    score.position_errors_m.push_back(d.head<3>().norm());
    score.rotation_errors_rad.push_back(d.tail<3>().norm());
    const Eigen::LLT<Matrix6d> P(pose.T_B_N.covariance);
    if (P.info() == Eigen::Success)
      nees.push_back(d.dot(P.solve(d)));
    else
      ++score.bad_covariances;
  }
  score.median_nees = median_of(std::move(nees));
  return score;
}

}  // namespace crepes
