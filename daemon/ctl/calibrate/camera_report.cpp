#include "daemon/ctl/calibrate/camera_report.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "daemon/ctl/calibrate/camchain.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/camera/lens_conversion.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kMs = 1e3;
constexpr double kMm = 1e3;
constexpr double kHundredths = 100.0;

std::vector<double> numbers_of(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

std::vector<std::vector<std::string>> lens_rows(const CameraBatchResult& found) {
  constexpr std::array kNames{"xi", "alpha", "fx px", "fy px", "cx px", "cy px"};
  std::vector<std::vector<std::string>> rows{{"", "value", "+-"}};
  for (int i = 0; i < 6; ++i) {
    const int decimals = i < 2 ? 5 : 3;
    rows.push_back({kNames.at(static_cast<std::size_t>(i)),
                    fixed(found.constants.lens[i], decimals),
                    fixed(found.lens_sigma[i], decimals)});
  }
  const Eigen::Vector3d p_B_C = found.constants.p_B_C;
  constexpr std::array kAxes{"camera x mm", "camera y mm", "camera z mm"};
  for (int i = 0; i < 3; ++i) {
    rows.push_back({kAxes.at(static_cast<std::size_t>(i)), fixed(kMm * p_B_C[i], 1),
                    fixed(kMm * found.position_sigma_m[i], 1)});
  }
  rows.push_back({"time shift ms", fixed(kMs * found.constants.shift_s, 3),
                  fixed(kMs * found.shift_sigma_s, 3)});
  return rows;
}

std::string conversion_line(const std::optional<KannalaBrandtFit>& kb) {
  if (!kb) return "";
  return fmt::format(
      "converted to Kannala-Brandt: {} px RMS from the Double Sphere over the picture, at most "
      "{}\n",
      fixed(kb->rms_px, 3), fixed(kb->max_px, 3));
}

std::string camera_text(const CameraBatchResult& found, const SeenTarget& target,
                        const std::optional<KannalaBrandtFit>& kb,
                        const std::filesystem::path& out) {
  const Eigen::Vector3d turn = found.rotation_sigma_rad * kDegPerRad;
  return text_table(lens_rows(found)) +
         fmt::format(
             "rotation to {} deg; lens and rotation to {} px over the picture (one sigma)\n"
             "{} {}; residuals {} px, in held-out seconds {} px; outliers {} %\n",
             fixed(turn.norm(), 4), fixed(found.lens_sigma_px, 3), target.count, target.words,
             fixed(found.spot_sigma_px, 3), fixed(found.held_out_px, 3),
             fixed(100.0 * found.outliers, 1)) +
         conversion_line(kb) + map_text(found.map) + warning_lines(found.warnings) +
         fmt::format("written: {}\n", out.string());
}

std::string camera_json(const CameraBatchResult& found, const SeenTarget& target,
                        const std::optional<KannalaBrandtFit>& kb) {
  Json json = report_head(found.refusals, found.warnings);
  json[target.key] = target.count;
  json["rate_rms_radps"] = numbers_of(found.rate_rms_radps);
  if (found.covariance.size() > 0) {
    const CameraConstants& c = found.constants;
    const Eigen::Matrix4d T = [&] {
      Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
      M.topLeftCorner<3, 3>() = c.T_C_B().R();
      M.topRightCorner<3, 1>() = c.T_C_B().p;
      return M;
    }();
    json["intrinsics"] = numbers_of(c.lens);
    json["intrinsics_sigma"] = numbers_of(found.lens_sigma);
    json["T_cam_imu"] = {numbers_of(T.row(0)), numbers_of(T.row(1)), numbers_of(T.row(2)),
                         numbers_of(T.row(3))};
    json["rotation_sigma_rad"] = numbers_of(found.rotation_sigma_rad);
    json["camera_in_body_m"] = numbers_of(c.p_B_C);
    json["camera_in_body_sigma_m"] = numbers_of(found.position_sigma_m);
    json["timeshift_cam_imu"] = c.shift_s;
    json["timeshift_cam_imu_sigma"] = found.shift_sigma_s;
    json["gyro_bias"] = numbers_of(found.gyro_bias);
    json["lens_sigma_px"] = found.lens_sigma_px;
    json["residual_px"] = found.spot_sigma_px;
    json["held_out_px"] = found.held_out_px;
    json["outliers"] = found.outliers;
    for (const ResidualMap::Cell& cell : found.map.cells) {
      json["map_count"].push_back(cell.count);
      json["map_rms_px"].push_back(cell.rms_px());
    }
    json["map_columns"] = ResidualMap::kColumns;
    if (kb) {
      json["kannala_brandt"] = {{"intrinsics", numbers_of(kb->pinhole)},
                                {"distortion_coeffs", kb->k},
                                {"rms_px", kb->rms_px},
                                {"max_px", kb->max_px}};
    }
  }
  return json_line(json);
}

}  // namespace

std::string map_text(const ResidualMap& map) {
  std::string text = "residuals over the picture [px/100 RMS]; . was never seen\n";
  for (int row = 0; row < ResidualMap::kRows; ++row) {
    for (int column = 0; column < ResidualMap::kColumns; ++column) {
      const ResidualMap::Cell& cell = map.at(row, column);
      text += cell.count == 0 ? "    ." : fmt::format("{:5.0f}", kHundredths * cell.rms_px());
    }
    text += "\n";
  }
  return text;
}

Result<void> report_camera(const CameraBatchResult& found, const SeenTarget& target,
                           const CameraOutput& output, CalibrationReport& report) {
  report.reasons = found.refusals;
  std::optional<KannalaBrandtFit> kb;
  if (output.kannala_brandt && found.covariance.size() > 0)
    kb = to_kannala_brandt(found.constants.lens, output.resolution[0], output.resolution[1]);
  if (found.refusals.empty()) {
    const auto written = write_text_file(
        output.out, camchain_text(calibration_of(found.constants, output.resolution, kb),
                                  Mounting::kKnown, "camera"));
    if (!written) return tl::unexpected(written.error());
  }
  if (output.json) {
    report.text = camera_json(found, target, kb);
  } else if (found.refusals.empty()) {
    report.text = camera_text(found, target, kb, output.out);
  }
  return {};
}

}  // namespace crepes
