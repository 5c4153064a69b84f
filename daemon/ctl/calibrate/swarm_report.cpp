#include "daemon/ctl/calibrate/swarm_report.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "config/writing/config_writer.hpp"
#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "daemon/ctl/calibrate/camchain.hpp"
#include "daemon/ctl/calibrate/imu_fragment.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/calibration/imu/imu_calibration.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;
namespace swarm_at = swarm_constants;

constexpr double kMillis = 1e3;
constexpr const char* kNotDetermined = "not determined";

std::vector<double> swarm_list(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

/// `sigma` is of M by rows; of an upper triangular one without the zeros.
TriadEstimate triad_of(const Eigen::Matrix3d& M, const Eigen::VectorXd& sigma,
                       const Eigen::Vector3d& bias) {
  TriadEstimate triad;
  triad.M = M;
  triad.bias = bias;
  const bool is_triangular = sigma.size() == 6;
  Eigen::Index next = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = is_triangular ? i : 0; j < 3; ++j) triad.M_sigma(i, j) = sigma[next++];
  return triad;
}

/// Of the sensor, in place of what was in force.
ImuTriads triads_of(const CalibratedRobot& robot, const ImuDeviceConfig& in_force) {
  const CameraConstants& c = robot.after.camera;
  const auto gyro = robot.sigma.segment<9>(swarm_at::kGyroMatrix);
  const auto accel = robot.sigma.segment<6>(swarm_at::kGyroMatrix + 9);
  return of_sensor(
      {triad_of(c.M_accel, accel, robot.accel_bias), triad_of(c.M_gyro, gyro, robot.gyro_bias)},
      in_force);
}

std::string imu_part(const CalibratedRobot& robot, const ImuDeviceConfig& in_force) {
  const ImuTriads sensor = triads_of(robot, in_force);
  return "imu:\n" + triad_text("accelerometer", sensor.accelerometer) +
         triad_text("gyroscope", sensor.gyroscope);
}

std::string ranges_part(const SwarmBatchResult& found, const SwarmDataset& dataset) {
  std::string text = "ranges:\n  pairs:\n";
  std::string modules = "  modules:\n";
  for (std::size_t i = 0; i < found.robots.size(); ++i) {
    const double delay_m = found.robots[i].after.range_delay_m;
    const int id = dataset.robots[i].robot.id.value;
    modules += fmt::format("  - {{id: {}, bias_m: {}}}\n", id, to_yaml(delay_m));
    for (std::size_t j = i + 1; j < found.robots.size(); ++j) {
      text +=
          fmt::format("  - {{ids: [{}, {}], bias_m: {}}}\n", id, dataset.robots[j].robot.id.value,
                      to_yaml(delay_m + found.robots[j].after.range_delay_m));
    }
  }
  return text + modules;
}

std::string members_part(const SwarmBatchResult& found, const SwarmDataset& dataset,
                         bool with_delays) {
  std::string text = "swarm:\n  members:\n";
  for (std::size_t r = 0; r < found.robots.size(); ++r) {
    const RobotConstants& robot = found.robots[r].after;
    text +=
        fmt::format("  - {{id: {}, p_body_led: {}, p_body_uwb: {}{}}}\n",
                    dataset.robots[r].robot.id.value, to_yaml(robot.p_B_M), to_yaml(robot.p_B_U),
                    with_delays ? ", range_delay_m: " + to_yaml(robot.range_delay_m) : "");
  }
  return text;
}

/// The default's bias is of ranges from which no delay was taken off.
std::string uwb_part(const SwarmBatchResult& found, std::size_t robot) {
  return fmt::format("uwb: {{bias_sigma_m: {}}}\n", fixed(remaining_range_bias(found, robot), 3));
}

std::string camera_part(const CameraConstants& constants, const CameraCalibration& camera) {
  const Pose T_C_B = constants.T_C_B();
  return fmt::format(
      "cameras:\n- name: {}\n  camera_model: ds\n  intrinsics: {}\n  T_cam_imu: {}\n"
      "  timeshift_cam_imu: {}\n  calibrated: true\n",
      camera.name, to_yaml(swarm_list(constants.lens)), to_yaml(T_C_B), to_yaml(constants.shift_s));
}

/// A number before and after, its sigma, and whether the flight determined it.
std::vector<std::string> row_of(const std::string& name, const CalibratedRobot& robot, int index,
                                double before, double after, double unit, int decimals) {
  return {name, fixed(unit * before, decimals), fixed(unit * after, decimals),
          fixed(unit * robot.sigma(index), decimals),
          robot.is_determined(index) ? "" : kNotDetermined};
}

std::vector<std::vector<std::string>> rows_of(const CalibratedRobot& robot) {
  const RobotConstants& a = robot.before;
  const RobotConstants& b = robot.after;
  const RobotPriors moved = difference(a, b);
  constexpr std::array kLens{"xi", "alpha", "fx px", "fy px", "cx px", "cy px"};
  constexpr std::array kAxes{"x", "y", "z"};
  std::vector<std::vector<std::string>> rows{{"", "before", "after", "+-", ""}};
  for (int i = 0; i < 6; ++i) {
    rows.push_back(row_of(kLens.at(static_cast<std::size_t>(i)), robot, swarm_at::kLens + i,
                          a.camera.lens[i], b.camera.lens[i], 1.0, i < 2 ? 4 : 2));
  }
  const auto vector = [&](const std::string& name, int index, const Eigen::Vector3d& before,
                          const Eigen::Vector3d& after, double unit, int decimals) {
    for (int i = 0; i < 3; ++i) {
      rows.push_back(row_of(name + " " + kAxes.at(static_cast<std::size_t>(i)), robot, index + i,
                            before[i], after[i], unit, decimals));
    }
  };
  vector("camera turned, deg", swarm_at::kRotation, Eigen::Vector3d::Zero(),
         moved.segment<3>(swarm_at::kRotation), kDegPerRad, 3);
  vector("camera mm", swarm_at::kPosition, a.camera.p_B_C, b.camera.p_B_C, kMillis, 1);
  rows.push_back(row_of("time shift ms", robot, swarm_at::kShift, a.camera.shift_s,
                        b.camera.shift_s, kMillis, 3));
  vector("LED ring mm", swarm_at::kRing, a.p_B_M, b.p_B_M, kMillis, 1);
  vector("antenna mm", swarm_at::kAntenna, a.p_B_U, b.p_B_U, kMillis, 1);
  rows.push_back(row_of("antenna delay mm", robot, swarm_at::kDelay, a.range_delay_m,
                        b.range_delay_m, kMillis, 1));
  return rows;
}

std::string imu_line(const CalibratedRobot& robot) {
  int determined = 0;
  for (int i = swarm_at::kGyroMatrix; i < swarm_at::kRing; ++i)
    determined += robot.is_determined(i) ? 1 : 0;
  return fmt::format("scales and axes of the IMU: {} of {} are determined\n", determined,
                     swarm_at::kRing - swarm_at::kGyroMatrix);
}

Json triad_json(const TriadEstimate& triad) {
  Json json;
  json["bias"] = swarm_list(triad.bias);
  json["scale"] = swarm_list(triad.scale());
  const auto rows = [](const Eigen::Matrix3d& M) {
    return Json{swarm_list(M.row(0)), swarm_list(M.row(1)), swarm_list(M.row(2))};
  };
  json["misalignment"] = rows(triad.misalignment());
  json["matrix_sigma"] = rows(triad.M_sigma);
  return json;
}

Json robot_json(const CalibratedRobot& robot, const SwarmRobot& name,
                const ImuDeviceConfig& in_force) {
  const RobotConstants& c = robot.after;
  const auto sigma3 = [&](int index) { return swarm_list(robot.sigma.segment<3>(index)); };
  Json json{{"id", name.id.value}, {"name", name.name}};
  json["intrinsics"] = swarm_list(c.camera.lens);
  json["intrinsics_sigma"] = swarm_list(robot.sigma.segment<6>(swarm_at::kLens));
  const Pose T_C_B = c.camera.T_C_B();
  const Eigen::Matrix3d R = T_C_B.R();
  for (int i = 0; i < 3; ++i) json["T_cam_imu"].push_back({R(i, 0), R(i, 1), R(i, 2), T_C_B.p[i]});
  json["T_cam_imu"].push_back({0.0, 0.0, 0.0, 1.0});
  json["rotation_sigma_rad"] = sigma3(swarm_at::kRotation);
  json["camera_in_body_m"] = swarm_list(c.camera.p_B_C);
  json["camera_in_body_sigma_m"] = sigma3(swarm_at::kPosition);
  json["timeshift_cam_imu"] = c.camera.shift_s;
  json["timeshift_cam_imu_sigma"] = robot.sigma(swarm_at::kShift);
  json["p_body_led"] = swarm_list(c.p_B_M);
  json["p_body_led_sigma"] = sigma3(swarm_at::kRing);
  json["p_body_uwb"] = swarm_list(c.p_B_U);
  json["p_body_uwb_sigma"] = sigma3(swarm_at::kAntenna);
  json["range_delay_m"] = c.range_delay_m;
  json["range_delay_sigma_m"] = robot.sigma(swarm_at::kDelay);
  const ImuTriads sensor = triads_of(robot, in_force);
  json["accelerometer"] = triad_json(sensor.accelerometer);
  json["gyroscope"] = triad_json(sensor.gyroscope);
  json["not_determined"] = Json::array();
  for (const std::vector<std::string>& row : rows_of(robot))
    if (row.back() == kNotDetermined) json["not_determined"].push_back(row.front());
  json["spot_before_px"] = robot.spot_before_px;
  json["spot_sigma_px"] = robot.spot_sigma_px;
  json["outliers"] = robot.outliers;
  json["sightings"] = robot.sightings;
  return json;
}

}  // namespace

std::string calibration_text(const SwarmBatchResult& found, const SwarmDataset& dataset,
                             std::size_t robot) {
  const CalibratedRobot& own = found.robots[robot];
  const auto& resolution = dataset.robots[robot].config.cameras.front().calibration.resolution;
  return camchain_text(calibration_of(own.after.camera, resolution, std::nullopt), Mounting::kKnown,
                       "swarm") +
         imu_part(own, dataset.robots[robot].config.imu.device) + ranges_part(found, dataset) +
         members_part(found, dataset, false);
}

std::string fragment_text(const SwarmBatchResult& found, const SwarmDataset& dataset,
                          std::size_t robot) {
  const RobotRecording& recording = dataset.robots[robot];
  return fmt::format("# Written by crepesctl calibrate swarm: copy it to crepesd.d/ on {}.\n",
                     recording.robot.name) +
         camera_part(found.robots[robot].after.camera,
                     recording.config.cameras.front().calibration) +
         imu_part(found.robots[robot], recording.config.imu.device) +
         members_part(found, dataset, true) + uwb_part(found, robot);
}

std::string swarm_text(const SwarmBatchResult& found, const SwarmDataset& dataset,
                       const std::filesystem::path& out) {
  std::string text;
  for (std::size_t r = 0; r < found.robots.size(); ++r) {
    const CalibratedRobot& robot = found.robots[r];
    text +=
        fmt::format("{}: {} sightings, {} px before, {} px after, {} % outliers\n{}{}\n",
                    dataset.robots[r].robot.name, robot.sightings, fixed(robot.spot_before_px, 2),
                    fixed(robot.spot_sigma_px, 3), fixed(100.0 * robot.outliers, 1),
                    text_table(rows_of(robot)), imu_line(robot));
  }
  std::vector<std::vector<std::string>> pairs{
      {"pair", "ranges too long by both delays mm", "+-", "by the pair itself mm"}};
  for (std::size_t i = 0; i < found.robots.size(); ++i) {
    for (std::size_t j = i + 1; j < found.robots.size(); ++j) {
      pairs.push_back(
          {fmt::format("{},{}", dataset.robots[i].robot.name, dataset.robots[j].robot.name),
           fixed(kMillis *
                     (found.robots[i].after.range_delay_m + found.robots[j].after.range_delay_m),
                 1),
           fixed(kMillis * pair_delay_sigma(found, i, j), 1),
           fixed(kMillis * found.pair_bias_m[pair_index(i, j, found.robots.size())], 1)});
    }
  }
  return text + text_table(pairs) +
         fmt::format("{} s were used; a range's sigma {} m, outliers {} %\n",
                     fixed(found.seconds, 1), fixed(found.range_sigma_m, 3),
                     fixed(100.0 * found.range_outliers, 1)) +
         warning_lines(found.warnings) +
         fmt::format("written: {}/<robot>.yaml, and <robot>.fragment.yaml for crepesd.d/ of each\n",
                     out.string());
}

std::string swarm_json(const SwarmBatchResult& found, const SwarmDataset& dataset) {
  Json json = report_head(found.refusals, found.warnings);
  if (found.covariance.size() == 0) return json_line(json);
  json["seconds"] = found.seconds;
  json["range_sigma_m"] = found.range_sigma_m;
  json["range_outliers"] = found.range_outliers;
  json["robots"] = Json::array();
  for (std::size_t r = 0; r < found.robots.size(); ++r) {
    json["robots"].push_back(
        robot_json(found.robots[r], dataset.robots[r].robot, dataset.robots[r].config.imu.device));
  }
  json["pairs"] = Json::array();
  for (std::size_t i = 0; i < found.robots.size(); ++i) {
    for (std::size_t j = i + 1; j < found.robots.size(); ++j) {
      json["pairs"].push_back(
          {{"ids", {dataset.robots[i].robot.id.value, dataset.robots[j].robot.id.value}},
           {"bias_m", found.robots[i].after.range_delay_m + found.robots[j].after.range_delay_m},
           {"sigma_m", pair_delay_sigma(found, i, j)},
           {"own_bias_m", found.pair_bias_m[pair_index(i, j, found.robots.size())]}});
    }
  }
  return json_line(json);
}

}  // namespace crepes
