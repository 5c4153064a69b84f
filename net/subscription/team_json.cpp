#include "net/subscription/team_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "estimator/core/constants.hpp"
#include "net/subscription/fault_text.hpp"

namespace crepes {
namespace {

using Json = OrderedJson;

constexpr int kValueDigits = 4;
constexpr int kSigmaDigits = 2;

Json numbers(const Eigen::Vector3d& v, double unit, int digits) {
  Json list = Json::array();
  for (const double x : v) list.push_back(rounded_to_digits(unit * x, digits));
  return list;
}

/// Adds an estimate of three components, in `unit` times their own.
void put_estimate(Json& json, const char* key, const Eigen::Vector3d& value,
                  const Eigen::Vector3d& sigma, double unit = 1.0) {
  if (!value.allFinite() || !sigma.allFinite()) return;
  json[key] = {{"value", numbers(value, unit, kValueDigits)},
               {"sigma", numbers(sigma, unit, kSigmaDigits)}};
}

void put_estimate(Json& json, const char* key, double value, double sigma, double unit = 1.0) {
  if (!std::isfinite(value) || !std::isfinite(sigma)) return;
  json[key] = {{"value", rounded_to_digits(unit * value, kValueDigits)},
               {"sigma", rounded_to_digits(unit * sigma, kSigmaDigits)}};
}

Json camera_json(const CameraMisalignment& camera) {
  Json json{{"p_body_camera", numbers(camera.p_B_C, 1.0, kValueDigits)}};
  put_estimate(json, "misalignment_deg", camera.rotation, camera.covariance.diagonal().cwiseSqrt(),
               kDegPerRad);
  put_estimate(json, "turned_deg", camera.rotation.norm(), camera.angle_sigma_rad(), kDegPerRad);
  put_estimate(json, "lens_mrad", camera.lens, camera.lens_sigma, 1e3);
  json["state"] = name_of(camera.state);
  return json;
}

Json calibration_json(const RobotCalibration& robot, RobotId self) {
  Json json = Json::object();
  put_estimate(json, "gyro_bias_radps", robot.imu.gyro_radps, robot.imu.gyro_sigma_radps);
  put_estimate(json, "accel_bias_mps2", robot.imu.accel_mps2, robot.imu.accel_sigma_mps2);
  put_estimate(json, "gyro_scale", robot.imu.gyro_scale.diagonal(),
               robot.imu.gyro_scale_sigma.diagonal());
  put_estimate(json, "antenna_delay_m", robot.antenna_delay_m, robot.antenna_delay_sigma_m);
  if (robot.robot != self) put_estimate(json, "clock_ms", robot.clock_s, robot.clock_sigma_s, 1e3);
  json["cameras"] = Json::array();
  for (const CameraMisalignment& camera : robot.cameras)
    json["cameras"].push_back(camera_json(camera));
  return json;
}

Json residual_json(const ResidualStatus& residual) {
  Json json = Json::object();
  if (residual.nis) put(json, "nis", *residual.nis, 3);
  json["fused"] = residual.fused;
  json["refused"] = residual.refused;
  return json;
}

}  // namespace

Json team_robot_json(const TeamRobotStatus& robot, std::string_view name, RobotId self,
                     TeamDetail detail) {
  Json json{{"robot", robot.calibration.robot.value}};
  if (!name.empty()) json["name"] = truncated_utf8(name, kMaxName);
  json["trusted"] = robot.calibration.is_trusted;
  json["nis"] = Json::object();
  for (std::size_t kind = 0; kind < kTeamResidualKindCount; ++kind) {
    const std::string key(name_of(static_cast<TeamResidual::Kind>(kind)));
    const ResidualStatus& residual = robot.residuals.at(kind);
    if (residual.nis) put(json["nis"], key.c_str(), *residual.nis, 3);
    if (detail == TeamDetail::kFull && residual.fused + residual.refused > 0)
      json["residuals"][key] = residual_json(residual);
  }
  for (const TeamFault& fault : robot.faults)
    json["faults"].push_back(truncated_utf8(text_of(fault), kMaxText));
  if (detail == TeamDetail::kFull) json["calibration"] = calibration_json(robot.calibration, self);
  return json;
}

Json pair_filter_json(const NeighborStatus& neighbor) {
  Json json{{"peer", neighbor.neighbor.value}, {"name", truncated_utf8(neighbor.name, kMaxName)}};
  json["residuals"] = Json::object();
  for (std::size_t kind = 0; kind < kMeasurementKindCount; ++kind) {
    const VerdictCounts& counts = neighbor.measurements.at(kind);
    ResidualStatus residual{.nis = neighbor.nis.at(kind)};
    for (std::size_t verdict = 0; verdict < kVerdictCount; ++verdict)
      (static_cast<Verdict>(verdict) == Verdict::kFused ? residual.fused : residual.refused) +=
          counts.at(verdict);
    if (residual.fused + residual.refused > 0)
      json["residuals"][std::string(name_of(static_cast<MeasurementKind>(kind)))] =
          residual_json(residual);
  }
  if (!neighbor.calibration) return json;
  using R = CalibrationRecord;
  const R& record = *neighbor.calibration;
  Json& calibration = json["calibration"] = Json::object();
  const auto put_vector_at = [&](const char* key, R::Index index, double unit) {
    using Values = Eigen::Map<const Eigen::Vector3d>;
    put_estimate(calibration, key, Values(&record.value[index]), Values(&record.sigma[index]),
                 unit);
  };
  put_vector_at("own_gyro_bias_radps", R::kGyroB, 1.0);
  put_vector_at("own_accel_bias_mps2", R::kAccelB, 1.0);
  put_vector_at("own_misalignment_deg", R::kMisalignB, kDegPerRad);
  put_vector_at("gyro_bias_radps", R::kGyroN, 1.0);
  put_vector_at("accel_bias_mps2", R::kAccelN, 1.0);
  put_vector_at("misalignment_deg", R::kMisalignN, kDegPerRad);
  put_estimate(calibration, "range_bias_m", record.value[R::kRangeBias],
               record.sigma[R::kRangeBias]);
  return json;
}

}  // namespace crepes
