#include "drivers/sim/sim_uwb.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "drivers/sim/seeded_noise.hpp"
#include "drivers/uwb/nlink_encoder.hpp"

namespace crepes {
namespace {

constexpr std::uint64_t kPair = 0x70616972U;
constexpr std::uint64_t kSingle = 0x73696e676c65U;
constexpr double kPairBias = 0.045;  // m, one sigma
constexpr double kOutlierShare = 0.005;
constexpr double kThroughBias = 0.3;    // m, least
constexpr double kThroughSpread = 0.4;  // m, mean of the additional bias
constexpr double kThroughLoss = 12.0;   // dB on the first path

/// The bias that both modules of a pair share at `t_s`: a constant and a varying part.
double pair_bias(const SimWorld& world, RobotId a, RobotId b, const RangeNoise& config,
                 double t_s) {
  const auto [low, high] = std::minmax(a, b);
  const SeededNoise noise{kPair, static_cast<std::uint64_t>(world.seed()), low.value, high.value};
  const double phase = 2.0 * std::numbers::pi * noise.uniform(2);
  return kPairBias * noise.gaussian(0) +
         std::numbers::sqrt2 * config.bias_drift_m * std::sin(t_s / config.bias_time_s + phase);
}

}  // namespace

Result<SimUwb> SimUwb::make(const SimWorld& world, RobotId robot, const SwarmConfig& swarm,
                            const RangeNoise& config) {
  SimUwb uwb(world, config);
  bool is_member = false;
  for (const MemberConfig& member : swarm.members) {
    const std::string who = fmt::format("simulated UWB module of robot {}", member.id.value);
    if (!world.contains(member.id)) {
      return fail(ErrorCode::kConfig, fmt::format("{}: the scenario has no such robot", who));
    }
    const int id = member.uwb_id.value_or(member.id.value);
    if (id > UINT8_MAX)
      return fail(ErrorCode::kConfig, fmt::format("{}: NodeFrame3 ids end at 255", who));
    const Module module{member.id, static_cast<std::uint8_t>(id), member.p_body_uwb};
    if (member.id == robot) {
      uwb.self_ = module;
      is_member = true;
    } else {
      uwb.others_.push_back(module);
    }
  }
  if (!is_member) return fail(ErrorCode::kConfig, "this robot is not among swarm.members");
  return uwb;
}

std::vector<std::uint8_t> SimUwb::sample(double t_s) const {
  std::vector<NlinkNode> nodes;
  for (const Module& other : others_) nodes.push_back(measure(other, t_s));
  const auto time_ms = std::llround(t_s * 1000.0);
  return encode_node_frame3(self_.id, static_cast<std::uint32_t>(time_ms), nodes);
}

NlinkNode SimUwb::measure(const Module& other, double t_s) const {
  const Eigen::Vector3d p_W_U = world_.T_W_B(self_.robot, t_s) * self_.p_body_uwb;
  const Eigen::Vector3d p_W_Q = world_.T_W_B(other.robot, t_s) * other.p_body_uwb;
  const double distance = (p_W_Q - p_W_U).norm();

  const SeededNoise noise{kSingle, static_cast<std::uint64_t>(world_.seed()), self_.robot.value,
                          other.robot.value};
  const auto index = 8 * static_cast<std::uint64_t>(std::llround(t_s * 1000.0));
  double range = distance + pair_bias(world_, self_.robot, other.robot, config_, t_s) +
                 config_.noise_m * noise.gaussian(index);
  // Free-space loss, as measured between modules: about -80 dBm at 5 m.
  const double received = -66.0 - 20.0 * std::log10(std::max(distance, 0.1));
  double first_path = received - 2.0 - noise.uniform(index + 2);
  if (world_.is_occluded(p_W_U, p_W_Q)) {
    range += kThroughBias - kThroughSpread * std::log(noise.uniform(index + 3));
    first_path -= kThroughLoss;
  } else if (noise.uniform(index + 4) < kOutlierShare) {
    range += 1.5 * noise.uniform(index + 5);
  }
  return {.module = other.id,
          .range_m = std::max(range, 0.001),
          .first_path_dbm = first_path,
          .received_dbm = received};
}

}  // namespace crepes
