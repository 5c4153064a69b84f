/// Poses for a program that was configured to get them: no lease, no request. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/outputs.hpp"
#include "net/endpoint.hpp"
#include "net/pose_rate.hpp"

namespace crepes {

class PosePush {
 public:
  /// `config` has passed validation; `names` are the neighbors'.
  PosePush(const PushConfig& config, RobotId self, std::map<RobotId, std::string> names);

  [[nodiscard]] const Endpoint& target() const { return target_; }

  /// What to send of these poses, at most kMaxSubscriptionDatagram bytes each; stamps of one
  /// neighbor must not go back.
  [[nodiscard]] std::vector<std::string> datagrams(const std::vector<NeighborPose>& poses);

 private:
  Endpoint target_;
  PushFormat format_;
  PoseRate rate_;
  RobotId self_;
  std::map<RobotId, std::string> names_;
  std::uint64_t sequence_ = 0;
};

/// The poses as PlotJuggler's UDP server reads them: nothing but numbers, a `timestamp` [s] on top
/// and each neighbor under its id. Neighbors share a datagram as far as stamp and space allow.
///   {"timestamp":12.5,"3":{"x":..,"y":..,"z":..,"qw":..,"qx":..,"qy":..,"qz":..,"roll":..,
///    "pitch":..,"yaw":..,"vx":..,"vy":..,"vz":..,"sigma_m":..,"sigma_rad":..,"age_s":..,"mode":0}}
/// Angles are radians, `mode` counts direct, graph, predicted; the sigmas are the roots of the
/// traces over 3 of both blocks of the covariance.
[[nodiscard]] std::vector<std::string> plot_json(const std::vector<NeighborPose>& poses);

}  // namespace crepes
