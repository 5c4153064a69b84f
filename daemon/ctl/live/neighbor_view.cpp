#include "daemon/ctl/live/neighbor_view.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>

namespace crepes {
namespace {

constexpr Duration kStale = std::chrono::milliseconds(500);
constexpr double kUnknownRate = std::numeric_limits<double>::quiet_NaN();

double largest_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues().maxCoeff()));
}

}  // namespace

PoseSigma sigma_of(const Matrix6d& covariance) {
  return {largest_sigma(covariance.topLeftCorner<3, 3>()),
          largest_sigma(covariance.bottomRightCorner<3, 3>())};
}

void NeighborView::update(const NeighborPose& pose, Timestamp now) {
  const Duration elapsed = now - window_start_;
  if (elapsed > std::chrono::seconds(1)) {
    const bool is_continuous = elapsed < std::chrono::seconds(2);
    rate_hz_ = is_continuous ? in_window_ / to_seconds(elapsed) : kUnknownRate;
    window_start_ = now;
    in_window_ = 0;
  }
  ++in_window_;
  pose_ = pose;
  received_at_ = now;
}

const NeighborPose* NeighborView::pose(Timestamp now) const {
  return pose_ && now - received_at_ <= kStale ? &*pose_ : nullptr;
}

double NeighborView::rate_hz(Timestamp now) const {
  return pose(now) != nullptr ? rate_hz_ : kUnknownRate;
}

}  // namespace crepes
