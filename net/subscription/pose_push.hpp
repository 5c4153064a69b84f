/// Poses for a configured program: without request or lease. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "net/endpoint.hpp"
#include "net/subscription/rate_divider.hpp"
#include "net/subscription/subscription_config.hpp"

namespace crepes {

class PosePush {
 public:
  /// `config` must be valid; `names` are the names of the neighbors.
  PosePush(const PushConfig& config, RobotId self, std::map<RobotId, std::string> names);

  [[nodiscard]] const Endpoint& target() const { return target_; }

  /// The datagrams to send, at most kMaxSubscriptionDatagram bytes each. Stamps of one neighbor
  /// must not decrease.
  [[nodiscard]] std::vector<std::string> datagrams(const std::vector<NeighborPose>& poses);

 private:
  Endpoint target_;
  PushFormat format_;
  RateDivider rate_;
  RobotId self_;
  std::map<RobotId, std::string> names_;
  std::uint64_t sequence_ = 0;
};

/// The poses in the format of PlotJuggler's UDP server: numbers only, a `timestamp` [s] at the top
/// level and each neighbor under its id. Neighbors with equal stamps share a datagram if they fit.
///   {"timestamp":12.5,"3":{"x":..,"y":..,"z":..,"qw":..,"qx":..,"qy":..,"qz":..,"roll":..,
///    "pitch":..,"yaw":..,"vx":..,"vy":..,"vz":..,"sigma_m":..,"sigma_rad":..,"age_s":..,"mode":0}}
/// Angles are radians. `mode` is 0 for direct, 1 for graph, 2 for predicted. The sigmas are
/// sqrt(trace / 3) of the position and the orientation block of the covariance.
[[nodiscard]] std::vector<std::string> plot_json(const std::vector<NeighborPose>& poses);

}  // namespace crepes
