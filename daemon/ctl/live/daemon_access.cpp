#include "daemon/ctl/live/daemon_access.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

namespace crepes {
namespace {

Eigen::Vector3d vector_of(const client::Vector& v) { return {v.x, v.y, v.z}; }

PoseMode mode_of(client::Mode mode) {
  switch (mode) {
    case client::Mode::kDirect:
      return PoseMode::kDirect;
    case client::Mode::kGraph:
      return PoseMode::kGraph;
    case client::Mode::kPredicted:
      break;
  }
  return PoseMode::kPredicted;
}

Matrix6d covariance_of(const std::array<double, 21>& upper) {
  const auto rows = client::matrix_of(upper);
  Matrix6d P;
  for (Eigen::Index i = 0; i < 6; ++i) {
    P.row(i) =
        Eigen::Map<const Eigen::RowVector<double, 6>>(rows.at(static_cast<std::size_t>(i)).data());
  }
  return P;
}

}  // namespace

Result<client::Connection> connect(const DaemonAddress& daemon, const client::Requests& requests) {
  std::string fault;
  auto connection = client::Connection::open(daemon, requests, fault);
  if (!connection) return fail(ErrorCode::kUsage, std::move(fault));
  return std::move(*connection);
}

Error no_answer_from(const DaemonAddress& daemon, const std::string& send_fault) {
  return {ErrorCode::kNotFound,
          fmt::format("no answer from {} port {}: {}", daemon.address, daemon.port,
                      send_fault.empty() ? "is crepesd running there?" : send_fault)};
}

Result<void> ask_to_reload(pid_t daemon) {
  if (::kill(daemon, SIGHUP) == 0) return {};
  return fail(ErrorCode::kIo,
              fmt::format("process {}: {}", daemon, std::generic_category().message(errno)));
}

NeighborPose neighbor_pose_of(const client::Pose& pose) {
  NeighborPose result;
  result.neighbor = RobotId{pose.peer};
  result.stamp = Timestamp{Duration{pose.t_ns}};
  result.mode = mode_of(pose.mode);
  result.T_B_N.pose.p = vector_of(pose.position);
  const client::Quaternion& q = pose.orientation;
  result.T_B_N.pose.q = Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
  if (pose.covariance) result.T_B_N.covariance = covariance_of(*pose.covariance);
  if (pose.velocity) result.v_B_N = vector_of(*pose.velocity);
  if (pose.up) result.up_B = vector_of(*pose.up);
  result.age_s = pose.age_s;
  result.reset_counter = pose.reset_counter;
  return result;
}

}  // namespace crepes
