#include "net/subscription/pose_push.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "estimator/core/contract.hpp"
#include "net/subscription/json_parts.hpp"
#include "net/subscription/subscription_json.hpp"

namespace crepes {
namespace {

Endpoint target_of(const PushConfig& config) {
  const auto target = Endpoint::parse(config.address, static_cast<std::uint16_t>(config.port));
  CREPES_EXPECT(target.has_value(), "a valid configuration has numeric addresses");
  return *target;
}

OrderedJson numbers_of(const NeighborPose& pose) {
  OrderedJson json = OrderedJson::object();
  const auto put_all = [&](std::initializer_list<const char*> keys, const auto& values) {
    Eigen::Index i = 0;
    for (const char* key : keys) put(json, key, values[i++]);
  };
  const Eigen::Quaterniond& q = pose.T_B_N.pose.q;
  const Matrix6d& P = pose.T_B_N.covariance;
  put_all({"x", "y", "z"}, pose.T_B_N.pose.p);
  put_all({"qw", "qx", "qy", "qz"}, Eigen::Vector4d(q.w(), q.x(), q.y(), q.z()));
  put_all({"roll", "pitch", "yaw"}, roll_pitch_yaw_of(q));
  put_all({"vx", "vy", "vz"}, pose.v_B_N);
  put(json, "sigma_m", std::sqrt(P.topLeftCorner<3, 3>().trace() / 3), 4);
  put(json, "sigma_rad", std::sqrt(P.bottomRightCorner<3, 3>().trace() / 3), 4);
  put(json, "age_s", pose.age_s, 4);
  json["mode"] = static_cast<int>(pose.mode);
  return json;
}

}  // namespace

std::vector<std::string> plot_json(const std::vector<NeighborPose>& poses) {
  std::vector<std::string> datagrams;
  Timestamp stamp{};
  OrderedJson json;
  for (const NeighborPose& pose : poses) {
    const std::string id = fmt::to_string(pose.neighbor.value);
    OrderedJson longer = json;
    longer[id] = numbers_of(pose);
    std::string text = dump(longer);
    const bool fits = !datagrams.empty() && pose.stamp == stamp && !json.contains(id) &&
                      text.size() <= kMaxSubscriptionDatagram;
    if (!fits) {
      stamp = pose.stamp;
      longer = {{"timestamp", to_seconds(stamp.time_since_epoch())}, {id, numbers_of(pose)}};
      text = dump(longer);
      datagrams.emplace_back();
    }
    json = std::move(longer);
    datagrams.back() = std::move(text);
  }
  return datagrams;
}

PosePush::PosePush(const PushConfig& config, RobotId self, std::map<RobotId, std::string> names)
    : target_(target_of(config)),
      format_(config.format),
      rate_(config.rate_hz),
      self_(self),
      names_(std::move(names)) {}

std::vector<std::string> PosePush::datagrams(const std::vector<NeighborPose>& poses) {
  std::vector<NeighborPose> due;
  for (const NeighborPose& pose : poses)
    if (rate_.is_due(pose.neighbor, pose.stamp)) due.push_back(pose);
  if (format_ == PushFormat::kPlotJuggler) return plot_json(due);
  std::vector<std::string> texts;
  texts.reserve(due.size());
  for (const NeighborPose& pose : due)
    texts.push_back(pose_json(sequence_++, self_, names_[pose.neighbor], pose));
  return texts;
}

}  // namespace crepes
