#include "daemon/ctl/view/view_json.hpp"

#include <fmt/core.h>

#include <cmath>

#include "daemon/ctl/live/neighbor_view.hpp"

namespace crepes {

std::string pose_row(double t_s, const NeighborPose& pose) {
  const Eigen::Vector3d& p = pose.T_B_N.pose.p;
  const Eigen::Quaterniond& q = pose.T_B_N.pose.q;
  const Matrix6d& P = pose.T_B_N.covariance;
  if (!p.allFinite() || !q.coeffs().allFinite() || !P.allFinite() || !std::isfinite(pose.age_s))
    return {};
  const PoseSigma sigma = sigma_of(P);
  return fmt::format(
      "[{:.4f},{},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.5f},{:.3g},{:.3g},{:.3g},{:.3g},"
      "{:.3g},{:.3g},{:.4g},{:.4g},{:.3f},{}]",
      t_s, static_cast<int>(pose.mode), p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), P(0, 0),
      P(0, 1), P(0, 2), P(1, 1), P(1, 2), P(2, 2), sigma.position_m, sigma.rotation_rad, pose.age_s,
      pose.reset_counter);
}

std::string truth_row(double t_s, const Pose& T_B_N) {
  const auto& [p, q] = T_B_N;
  return fmt::format("[{:.4f},{:.4f},{:.4f},{:.4f},{:.5f},{:.5f},{:.5f},{:.5f}]", t_s, p.x(), p.y(),
                     p.z(), q.w(), q.x(), q.y(), q.z());
}

std::string vector_row(const Eigen::Vector3d& v) {
  return fmt::format("[{:.5f},{:.5f},{:.5f}]", v.x(), v.y(), v.z());
}

std::string stream_event(std::string_view name, std::string_view json) {
  return fmt::format("event: {}\ndata: {}\n\n", name, json);
}

}  // namespace crepes
