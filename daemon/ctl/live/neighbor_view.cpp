#include "daemon/ctl/live/neighbor_view.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "drivers/base/number_text.hpp"

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

std::optional<RobotId> neighbor_named(const client::Status& status, const std::string& name_or_id) {
  using Neighbor = client::Status::Neighbor;
  auto found = std::ranges::find(status.neighbors, name_or_id, &Neighbor::name);
  std::uint16_t id = 0;
  if (found == status.neighbors.end() && parse_number(name_or_id, id).empty())
    found = std::ranges::find(status.neighbors, id, &Neighbor::peer);
  if (found == status.neighbors.end()) return std::nullopt;
  return RobotId{found->peer};
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
