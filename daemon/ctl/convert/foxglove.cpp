#include "daemon/ctl/convert/foxglove.hpp"

#include <fmt/core.h>
#include <sodium.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "daemon/ctl/live/neighbor_view.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

using Json = OrderedJson;

constexpr std::int64_t kSecond = 1'000'000'000;

Json time_json(std::int64_t time_ns) {
  return {{"sec", time_ns / kSecond}, {"nsec", time_ns % kSecond}};
}

Json vector_json(const Eigen::Vector3d& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }

Json quaternion_json(const Eigen::Quaterniond& q) {
  return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}};
}

// ---- schemas ----------------------------------------------------------------------------------

Json number() { return {{"type", "number"}}; }
Json integer() { return {{"type", "integer"}}; }
Json text() { return {{"type", "string"}}; }
Json object(Json properties) { return {{"type", "object"}, {"properties", std::move(properties)}}; }
Json list(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

Json time_type() {
  Json time = object({{"sec", integer()}, {"nsec", integer()}});
  time["title"] = "time";
  return time;
}
Json point_type() { return object({{"x", number()}, {"y", number()}}); }
Json vector_type() { return object({{"x", number()}, {"y", number()}, {"z", number()}}); }
Json quaternion_type() {
  return object({{"x", number()}, {"y", number()}, {"z", number()}, {"w", number()}});
}
Json color_type() {
  return object({{"r", number()}, {"g", number()}, {"b", number()}, {"a", number()}});
}

MessageKind kind(const char* name, Json properties) {
  Json schema{{"title", name}};
  schema.update(object(std::move(properties)));
  return {name, dump(schema)};
}

}  // namespace

MessageKind transform_kind() {
  return kind("foxglove.FrameTransform", {{"timestamp", time_type()},
                                          {"parent_frame_id", text()},
                                          {"child_frame_id", text()},
                                          {"translation", vector_type()},
                                          {"rotation", quaternion_type()}});
}

MessageKind pose_kind() {
  return kind(
      "foxglove.PoseInFrame",
      {{"timestamp", time_type()},
       {"frame_id", text()},
       {"pose", object({{"position", vector_type()}, {"orientation", quaternion_type()}})}});
}

MessageKind annotations_kind() {
  const Json circle = object({{"timestamp", time_type()},
                              {"position", point_type()},
                              {"diameter", number()},
                              {"thickness", number()},
                              {"fill_color", color_type()},
                              {"outline_color", color_type()}});
  return kind("foxglove.ImageAnnotations", {{"circles", list(circle)},
                                            {"points", list(object(Json::object()))},
                                            {"texts", list(object(Json::object()))}});
}

MessageKind picture_kind() {
  Json bytes = text();
  bytes["contentEncoding"] = "base64";
  return kind(
      "foxglove.CompressedImage",
      {{"timestamp", time_type()}, {"frame_id", text()}, {"data", bytes}, {"format", text()}});
}

MessageKind estimate_kind() {
  return kind("crepes.Estimate", {{"timestamp", time_type()},
                                  {"mode", text()},
                                  {"position", vector_type()},
                                  {"roll_deg", number()},
                                  {"pitch_deg", number()},
                                  {"yaw_deg", number()},
                                  {"sigma_m", number()},
                                  {"sigma_deg", number()},
                                  {"latency_s", number()},
                                  {"covariance", list(number())},
                                  {"error_m", number()},
                                  {"error_deg", number()}});
}

MessageKind innovation_kind() {
  return kind("crepes.Innovation", {{"timestamp", time_type()},
                                    {"kind", text()},
                                    {"verdict", text()},
                                    {"nis", number()},
                                    {"dimension", integer()},
                                    {"residual", list(number())},
                                    {"sigma", list(number())}});
}

MessageKind imu_kind() {
  return kind(
      "crepes.Imu",
      {{"timestamp", time_type()}, {"gyro_radps", vector_type()}, {"accel_mps2", vector_type()}});
}

MessageKind range_kind() {
  return kind("crepes.Range", {{"timestamp", time_type()},
                               {"neighbor", integer()},
                               {"range_m", number()},
                               {"first_path_dbm", number()},
                               {"received_dbm", number()}});
}

// ---- messages ---------------------------------------------------------------------------------

std::string transform_json(std::int64_t time_ns, std::string_view parent, std::string_view child,
                           const Pose& T_parent_child) {
  return dump(Json{{"timestamp", time_json(time_ns)},
                   {"parent_frame_id", parent},
                   {"child_frame_id", child},
                   {"translation", vector_json(T_parent_child.p)},
                   {"rotation", quaternion_json(T_parent_child.q)}});
}

std::string pose_json(std::int64_t time_ns, std::string_view frame, const Pose& pose) {
  return dump(Json{
      {"timestamp", time_json(time_ns)},
      {"frame_id", frame},
      {"pose", {{"position", vector_json(pose.p)}, {"orientation", quaternion_json(pose.q)}}}});
}

std::string annotations_json(std::int64_t time_ns, const std::vector<Spot>& spots) {
  const Json outline{{"r", 1.0}, {"g", 0.6}, {"b", 0.0}, {"a", 1.0}};
  const Json nothing{{"r", 0.0}, {"g", 0.0}, {"b", 0.0}, {"a", 0.0}};
  Json circles = Json::array();
  for (const Spot& spot : spots) {
    const double diameter = 2.0 * std::sqrt(spot.area_px2 / std::numbers::pi) + 4.0;
    // Foxglove's origin is the corner of the first pixel, ours its center.
    circles.push_back({{"timestamp", time_json(time_ns)},
                       {"position", {{"x", spot.u_px + 0.5}, {"y", spot.v_px + 0.5}}},
                       {"diameter", diameter},
                       {"thickness", 1.0},
                       {"fill_color", nothing},
                       {"outline_color", outline}});
  }
  return dump(
      Json{{"circles", std::move(circles)}, {"points", Json::array()}, {"texts", Json::array()}});
}

std::string picture_json(std::int64_t time_ns, std::string_view frame, std::string_view file) {
  std::string base64(sodium_base64_ENCODED_LEN(file.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(base64.data(), base64.size(),
                    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes of a file
                    reinterpret_cast<const unsigned char*>(file.data()), file.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  base64.pop_back();  // its terminating zero
  return dump(Json{
      {"timestamp", time_json(time_ns)}, {"frame_id", frame}, {"data", base64}, {"format", "png"}});
}

std::string estimate_json(std::int64_t time_ns, const NeighborPose& pose, const Pose* truth) {
  const auto& [p, q] = pose.T_B_N.pose;
  const PoseSigma sigma = sigma_of(pose.T_B_N.covariance);
  const Eigen::Vector3d angles = kDegPerRad * roll_pitch_yaw_of(q);
  Json json{{"timestamp", time_json(time_ns)},
            {"mode", name_of(pose.mode)},
            {"position", vector_json(p)},
            {"roll_deg", angles.x()},
            {"pitch_deg", angles.y()},
            {"yaw_deg", angles.z()},
            {"sigma_m", sigma.position_m},
            {"sigma_deg", kDegPerRad * sigma.rotation_rad},
            {"latency_s", to_seconds(pose.published - pose.stamp)},
            {"covariance", Json::array()}};
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column)
      json["covariance"].push_back(pose.T_B_N.covariance(row, column));
  }
  if (truth != nullptr) {
    const Vector6d d = pose_difference(pose.T_B_N.pose, *truth);
    json["error_m"] = d.head<3>().norm();
    json["error_deg"] = kDegPerRad * d.tail<3>().norm();
  }
  return dump(json);
}

std::string innovation_json(std::int64_t time_ns, const MeasurementRecord& record) {
  const Fusion& fusion = record.fusion;
  const auto values = [&](const auto& all) {
    Json some = Json::array();
    for (std::size_t i = 0; i < std::min(fusion.dimension, all.size()); ++i)
      some.push_back(all.at(i));
    return some;
  };
  return dump(Json{{"timestamp", time_json(time_ns)},
                   {"kind", name_of(record.kind)},
                   {"verdict", name_of(fusion.verdict)},
                   {"nis", fusion.nis},
                   {"dimension", fusion.dimension},
                   {"residual", values(fusion.residual)},
                   {"sigma", values(fusion.sigma)}});
}

std::string imu_json(std::int64_t time_ns, const ImuSample& sample) {
  return dump(Json{{"timestamp", time_json(time_ns)},
                   {"gyro_radps", vector_json(sample.gyro_radps)},
                   {"accel_mps2", vector_json(sample.accel_mps2)}});
}

std::string range_json(std::int64_t time_ns, const UwbRange& range) {
  return dump(Json{{"timestamp", time_json(time_ns)},
                   {"neighbor", range.neighbor.value},
                   {"range_m", range.range_m},
                   {"first_path_dbm", range.first_path_dbm},
                   {"received_dbm", range.received_dbm}});
}

}  // namespace crepes
