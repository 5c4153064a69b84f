#include "net/subscription/subscription_json.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = OrderedJson;

Json sources_of(const PoseSources& sources) {
  Json names = Json::array();
  if (sources.bearing) names.push_back("bearing");
  if (sources.peer_bearing) names.push_back("peer_bearing");
  if (sources.range) names.push_back("range");
  if (sources.imu) names.push_back("imu");
  if (sources.graph) names.push_back("graph");
  return names;
}

Json covariance_of(const Matrix6d& covariance) {
  Json entries = Json::array();
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column)
      entries.push_back(rounded_to_digits(covariance(row, column), 6));
  }
  return entries;
}

}  // namespace

std::string version_json(std::string_view release, double lease_s) {
  return dump({{"class", "VERSION"},
               {"release", truncated_utf8(release, kMaxText)},
               {"proto_major", 1},
               {"proto_minor", 0},
               {"lease_s", lease_s}});
}

std::string cookie_json(std::string_view cookie) {
  return dump({{"class", "COOKIE"}, {"cookie", truncated_utf8(cookie, kMaxText)}});
}

std::string pose_json(std::uint64_t sequence, RobotId self, std::string_view name,
                      const NeighborPose& pose) {
  Json json{{"class", "POSE"},
            {"seq", sequence},
            {"timestamp", to_seconds(pose.stamp.time_since_epoch())},
            {"t_ns", fmt::to_string(to_ns(pose.stamp))},
            {"t_pub_ns", fmt::to_string(to_ns(pose.published))},
            {"self", self.value},
            {"peer", pose.neighbor.value},
            {"name", truncated_utf8(name, kMaxName)},
            {"mode", name_of(pose.mode)}};
  const Eigen::Quaterniond& q = pose.T_B_N.pose.q;
  put_vector(json, "position", pose.T_B_N.pose.p);
  if (q.coeffs().allFinite()) {
    json["orientation"] = {{"w", rounded_to_digits(q.w(), 9)},
                           {"x", rounded_to_digits(q.x(), 9)},
                           {"y", rounded_to_digits(q.y(), 9)},
                           {"z", rounded_to_digits(q.z(), 9)}};
  }
  put_vector(json, "velocity", pose.v_B_N);
  if (pose.up_B) put_vector(json, "up", *pose.up_B);
  if (pose.T_B_N.covariance.allFinite()) json["covariance"] = covariance_of(pose.T_B_N.covariance);
  put(json, "age_s", pose.age_s, 4);
  json["reset_counter"] = pose.reset_counter;
  json["sources"] = sources_of(pose.sources);
  return dump(json);
}

std::string error_json(std::string_view message) {
  return dump({{"class", "ERROR"}, {"message", truncated_utf8(message, kMaxText)}});
}

}  // namespace crepes
