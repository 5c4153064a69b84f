#include "tests/faults/pose_trace.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "estimator/swarm/neighbor_track.hpp"

namespace crepes::faults {
namespace {

constexpr double kLongestGap_s = 0.5;  // between poses that follow each other
constexpr double kHonest_s = 0.1;      // of poses within 5 sigma end a run of others
constexpr double kWindow_s = 0.3;

/// Not a number if one is none.
double larger(double a, double b) { return a >= b || std::isnan(a) ? a : b; }

}  // namespace

void PoseTrace::add(const NeighborPose& pose, const Pose& truth, double true_s) {
  const Matrix6d& P = pose.T_B_N.covariance;
  Eigen::Matrix<double, 10, 1> numbers;
  numbers << pose.T_B_N.pose.p, pose.T_B_N.pose.q.coeffs(), pose.v_B_N;
  const bool is_finite = numbers.allFinite() && P.allFinite();
  not_finite_ += is_finite ? 0 : 1;
  const bool is_usable = P.llt().info() == Eigen::Success && is_certain(P);
  unusable_ += is_finite && !is_usable ? 1 : 0;
  for (const double number : numbers)
    hash_ = hash_ * 1099511628211U ^ std::bit_cast<std::uint64_t>(number);
  const Vector6d error = pose_difference(pose.T_B_N.pose, truth);
  const auto mahalanobis2 = [&](Eigen::Index at) {
    const Eigen::Vector3d part = error.segment<3>(at);
    return part.dot(pose.T_B_N.covariance.block<3, 3>(at, at).llt().solve(part));
  };
  errors_.push_back({.true_s = true_s,
                     .error_m = error.head<3>().norm(),
                     .error_rad = error.tail<3>().norm(),
                     .mahalanobis2 = larger(mahalanobis2(0), mahalanobis2(3)),
                     .mode = pose.mode});
}

Beyond PoseTrace::beyond(const Span& span) const {
  Beyond beyond;
  std::optional<double> since_s;   // of a run
  std::optional<double> honest_s;  // since when poses are within 5 sigma again
  double latest_s = 0.0;
  for (const PoseError& e : errors_) {
    if (!span.contains(e.true_s)) continue;
    const bool is_beyond = !(e.mahalanobis2 <= kBeyond5Sigma);
    if (e.true_s - latest_s > kLongestGap_s || (honest_s && e.true_s - *honest_s > kHonest_s))
      since_s.reset();
    if (is_beyond && !since_s) since_s = e.true_s;
    honest_s = is_beyond ? std::nullopt : std::optional(honest_s.value_or(e.true_s));
    latest_s = e.true_s;
    if (!is_beyond) continue;
    beyond.longest_s = std::max(beyond.longest_s, e.true_s - *since_s);
    beyond.worst_m = std::max(beyond.worst_m, e.error_m);
    beyond.worst_rad = std::max(beyond.worst_rad, e.error_rad);
  }
  return beyond;
}

double PoseTrace::count(const Span& span) const {
  return static_cast<double>(std::ranges::count_if(
      errors_, [&](const PoseError& pose) { return span.contains(pose.true_s); }));
}

double PoseTrace::rmse(const Span& span, double PoseError::*error) const {
  double square = 0.0;
  double count = 0.0;
  for (const PoseError& pose : errors_) {
    if (!span.contains(pose.true_s)) continue;
    square += pose.*error * pose.*error;
    ++count;
  }
  return count == 0.0 ? 0.0 : std::sqrt(square / count);
}

double PoseTrace::rmse_m(const Span& span) const { return rmse(span, &PoseError::error_m); }

double PoseTrace::rmse_rad(const Span& span) const { return rmse(span, &PoseError::error_rad); }

double PoseTrace::worst_m(const Span& span) const {
  double worst = 0.0;
  for (const PoseError& pose : errors_)
    if (span.contains(pose.true_s)) worst = std::max(worst, pose.error_m);
  return worst;
}

double PoseTrace::longest_absence_s(const Span& span) const {
  double longest = 0.0;
  double last_s = span.from_s;
  for (const PoseError& pose : errors_) {
    if (!span.contains(pose.true_s)) continue;
    longest = std::max(longest, pose.true_s - last_s);
    last_s = pose.true_s;
  }
  return std::max(longest, span.to_s - last_s);
}

double PoseTrace::recovered_at_s(const Span& span, double rmse_m) const {
  double recovered_s = span.from_s;
  for (double t = span.from_s; t + kWindow_s <= span.to_s; t += kWindow_s / 3) {
    const Span window{t, t + kWindow_s};
    const bool is_well = longest_absence_s(window) < kWindow_s && this->rmse_m(window) <= rmse_m;
    if (!is_well) recovered_s = window.to_s;
  }
  return recovered_s;
}

}  // namespace crepes::faults
