#include "daemon/ctl/calibrate/grid_report.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "daemon/ctl/calibrate/calibration_report.hpp"
#include "daemon/ctl/calibrate/camera_report.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::array kSphereNames{"xi", "alpha", "fx px", "fy px", "cx px", "cy px"};
constexpr std::array kPolynomialNames{"fx px", "fy px", "cx px", "cy px", "k1", "k2", "k3", "k4"};

std::vector<std::vector<std::string>> grid_lens_rows(const GridCalibration& found) {
  const bool is_sphere = found.lens.kind == LensKind::kDoubleSphere;
  std::vector<std::vector<std::string>> rows{{"", "value", "+-"}};
  for (Eigen::Index i = 0; i < found.lens.numbers.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const std::string name = is_sphere ? kSphereNames.at(k) : kPolynomialNames.at(k);
    const int decimals = name.ends_with("px") ? 3 : 5;
    rows.push_back({name, fixed(found.lens.numbers[i], decimals), fixed(found.sigma[i], decimals)});
  }
  return rows;
}

}  // namespace

std::string grid_text(const GridCalibration& found, std::size_t pictures,
                      const std::filesystem::path& out) {
  return text_table(grid_lens_rows(found)) +
         fmt::format(
             "the grid is seen in {} of {} pictures, out to {} deg; lens to {} px there (one "
             "sigma)\nresiduals {} px RMS, in held-out views {} px; outliers {} %\n",
             found.views.size(), pictures, fixed(found.seen_rad * kDegPerRad, 0),
             fixed(found.lens_sigma_px, 3), fixed(found.rms_px, 3), fixed(found.held_out_px, 3),
             fixed(100.0 * found.outliers, 1)) +
         map_text(found.map) + warning_lines(found.warnings) +
         fmt::format("written: {}, without T_cam_imu: calibrate it with an IMU, or measure it\n",
                     out.string());
}

std::string grid_json(const GridCalibration& found, const std::vector<GridPicture>& pictures) {
  nlohmann::ordered_json json = report_head(found.refusals, found.warnings);
  json["pictures"] = pictures.size();
  json["views"] = found.views.size();
  json["not_found"] = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < pictures.size(); ++k)
    if (std::ranges::find(found.views, k) == found.views.end())
      json["not_found"].push_back(pictures[k].name);
  if (found.covariance.size() == 0) return json_line(json);
  const bool is_sphere = found.lens.kind == LensKind::kDoubleSphere;
  const int intrinsics = is_sphere ? 6 : 4;
  using Numbers = std::vector<double>;
  const auto add = [&](const std::string& suffix, const Eigen::VectorXd& v) {
    json["intrinsics" + suffix] = Numbers(v.begin(), v.begin() + intrinsics);
    json["distortion_coeffs" + suffix] = Numbers(v.begin() + intrinsics, v.end());
  };
  json["camera_model"] = is_sphere ? "ds" : "pinhole";
  add("", found.lens.numbers);
  add("_sigma", found.sigma);
  json["lens_sigma_px"] = found.lens_sigma_px;
  json["residual_px"] = found.rms_px;
  json["held_out_px"] = found.held_out_px;
  json["outliers"] = found.outliers;
  json["seen_deg"] = found.seen_rad * kDegPerRad;
  json["tilt_deg"] = found.tilt_rad * kDegPerRad;
  for (const ResidualMap::Cell& cell : found.map.cells) {
    json["map_count"].push_back(cell.count);
    json["map_rms_px"].push_back(cell.rms_px());
  }
  json["map_columns"] = ResidualMap::kColumns;
  return json_line(json);
}

}  // namespace crepes
