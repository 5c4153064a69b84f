#include "daemon/ctl/score/pair_score.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr Duration kPeriod = std::chrono::milliseconds(20);

/// The share of the instants `origin + k 20 ms` inside the window that have a row. The first row
/// sets the phase of the grid. Each row serves the earliest free instant less than a period away,
/// so that jitter of the rows does not count.
double availability_of(std::span<const NeighborPose> inside, const ScoreWindow& window) {
  if (inside.empty()) return 0.0;
  const Timestamp origin = inside.front().stamp;
  const std::int64_t first = -((origin - window.begin) / kPeriod);
  const std::int64_t last = (window.end - origin) / kPeriod;
  std::int64_t served = 0;
  std::int64_t next = first;
  for (const NeighborPose& pose : inside) {
    const Duration since = pose.stamp - origin;  // not negative: the rows are in order
    const std::int64_t before = since / kPeriod;
    const bool is_on_grid = since % kPeriod == Duration::zero();
    const std::int64_t instant = std::max(next, before);
    if (instant > std::min(last, is_on_grid ? before : before + 1)) continue;
    ++served;
    next = instant + 1;
  }
  return static_cast<double>(served) / static_cast<double>(last - first + 1);
}

/// Counts lasting episodes of bad rows. A good row, or half a second without rows, ends an episode.
class EpisodeCounter {
 public:
  void add(Timestamp stamp, bool bad) {
    const bool goes_on = bad && begin_ && stamp - last_ <= kLongestGap;
    if (!goes_on) {
      begin_ = bad ? std::optional(stamp) : std::nullopt;
      counted_ = false;
    }
    last_ = stamp;
    if (counted_ || !begin_ || stamp - *begin_ <= kLasting) return;
    counted_ = true;
    ++episodes_;
  }
  [[nodiscard]] std::size_t episodes() const { return episodes_; }

 private:
  static constexpr Duration kLongestGap = std::chrono::milliseconds(500);
  static constexpr Duration kLasting = std::chrono::seconds(1);

  std::optional<Timestamp> begin_;
  Timestamp last_{};
  bool counted_ = false;
  std::size_t episodes_ = 0;
};

/// Squared Mahalanobis distance of the position alone; NaN without a positive definite covariance.
double position_mahalanobis2(const Vector6d& d, const Matrix6d& covariance) {
  const Eigen::LLT<Eigen::Matrix3d> P(covariance.topLeftCorner<3, 3>());
  if (P.info() != Eigen::Success) return kNaN;
  return P.matrixL().solve(d.head<3>()).squaredNorm();
}

bool is_diverged(double position_m, double rotation_rad, double nees) {
  constexpr double kMaxPosition = 1.0;            // m
  constexpr double kMaxRotation = radians(20.0);  // rad
  constexpr double kMostSigmas = 10.0;
  return position_m > kMaxPosition || rotation_rad > kMaxRotation ||
         !(nees <= kMostSigmas * kMostSigmas);
}

}  // namespace

double share_within(const std::vector<double>& values, double limit) {
  const auto within =
      std::count_if(values.begin(), values.end(), [limit](double x) { return x <= limit; });
  return static_cast<double>(within) / static_cast<double>(values.size());
}

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
  EpisodeCounter far;
  GrossErrorCounter gross;
  for (const NeighborPose& pose : inside) {
    ++score.modes.at(static_cast<std::size_t>(pose.mode));
    score.max_age = std::max(score.max_age, pose.published - pose.stamp);
    const std::optional<Pose> T_B_N = truth(pose.stamp);
    if (!T_B_N) continue;
    const Vector6d d = pose_difference(pose.T_B_N.pose, *T_B_N);
    score.position_errors_m.push_back(d.head<3>().norm());
    score.rotation_errors_rad.push_back(d.tail<3>().norm());
    const Eigen::LLT<Matrix6d> P(pose.T_B_N.covariance);
    const double nees = P.info() == Eigen::Success ? d.dot(P.solve(d)) : kNaN;
    far.add(pose.stamp, is_diverged(d.head<3>().norm(), d.tail<3>().norm(), nees));
    gross.add(pose.stamp, pose.mode, d.head<3>().norm(),
              position_mahalanobis2(d, pose.T_B_N.covariance));
    if (P.info() == Eigen::Success) {
      score.nees.push_back(nees);
    } else {
      ++score.bad_covariances;
    }
  }
  score.divergences = far.episodes();
  score.gross_errors = gross.errors();
  return score;
}

}  // namespace crepes
