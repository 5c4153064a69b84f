#include "daemon/ctl/calibrate/camera_coverage.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "daemon/ctl/json_line.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kLeastSightings = 3;       // of a cell
constexpr double kWholePicture = 0.9;    // of the cells inside the circle
constexpr double kEnoughTurning = 0.25;  // rad/s RMS about each axis; 0.2 are required
constexpr double kEnoughSeconds = 55.0;  // with a board in view
constexpr double kLongestStep = 0.1;     // s; between sightings that are one stretch of time
constexpr std::array<std::string_view, 3> kAxisNames{"x (roll)", "y (pitch)", "z (yaw)"};

char symbol_of(const CameraCoverage& coverage, int row, int column) {
  if (!coverage.is_inside(row, column)) return ' ';
  return coverage.is_seen(row, column) ? '#' : '.';
}

std::string line_of(const CameraCoverage& coverage, int row) {
  std::string line;
  for (int column = 0; column < CameraCoverage::kColumns; ++column)
    line += symbol_of(coverage, row, column);
  return line;
}

std::string board_list(const CameraCoverage& coverage) {
  std::string text;
  for (const RobotId id : coverage.boards())
    text += fmt::format("{}{}", text.empty() ? "" : ", ", id.value);
  return text.empty() ? "none" : text;
}

}  // namespace

CameraCoverage::CameraCoverage(const CameraCalibration& camera, const CameraModel& model,
                               const IdLibrary& library, const Config& config)
    : camera_(camera),
      model_(model),
      tracker_(camera, model, config.vision, library, config.robot.id) {}

Result<CameraCoverage> CameraCoverage::of(const Config& config) {
  if (config.cameras.empty())
    return fail(ErrorCode::kConfig, "the daemon's configuration has no camera");
  const CameraCalibration& camera = config.cameras.front().calibration;
  const auto model = CameraModel::from(camera);
  if (!model) return tl::unexpected(model.error());
  const auto library = IdLibrary::from(config.swarm);
  if (!library) return tl::unexpected(library.error());
  return CameraCoverage(camera, *model, *library, config);
}

void CameraCoverage::add(const ImuSample& sample) {
  rate_square_sum_ += sample.gyro_radps.cwiseAbs2();
  samples_ += 1.0;
}

void CameraCoverage::add(const SpotFrame& frame) {
  // Without the gyroscope: how the camera is mounted is not known yet.
  const std::vector<Bearing> bearings = tracker_.step(frame);
  for (const Bearing& bearing : bearings) {
    const auto uv = model_.project(camera_.T_cam_imu.q * bearing.u_B);
    if (!uv) continue;
    const auto cell = [](double pixel, int size, int cells) {
      return static_cast<std::size_t>(
          std::clamp(static_cast<int>(pixel / static_cast<double>(size) * cells), 0, cells - 1));
    };
    const std::size_t row = cell(uv->y(), camera_.resolution[1], kRows);
    const std::size_t column = cell(uv->x(), camera_.resolution[0], kColumns);
    if (++sightings_.at(row).at(column) == kLeastSightings)
      farthest_px_ =
          std::max(farthest_px_, radius_px(static_cast<int>(row), static_cast<int>(column)));
    boards_.insert(bearing.neighbor);
  }
  if (bearings.empty()) return;
  if (last_seen_) seen_s_ += std::clamp(to_seconds(frame.stamp - *last_seen_), 0.0, kLongestStep);
  last_seen_ = frame.stamp;
}

double CameraCoverage::radius_px(int row, int column) const {
  const double u = ((column + 0.5) / kColumns - 0.5) * camera_.resolution[0];
  const double v = ((row + 0.5) / kRows - 0.5) * camera_.resolution[1];
  return std::hypot(u, v);
}

bool CameraCoverage::is_inside(int row, int column) const {
  const double nearer = 0.5 * std::min(camera_.resolution[0], camera_.resolution[1]);
  return radius_px(row, column) < std::max(nearer, farthest_px_ + 1.0);
}

bool CameraCoverage::is_seen(int row, int column) const {
  return sightings_.at(static_cast<std::size_t>(row)).at(static_cast<std::size_t>(column)) >=
         kLeastSightings;
}

double CameraCoverage::picture_of(bool is_low, bool is_right) const {
  const int first_row = is_low ? kRows / 2 : 0;
  const int first_column = is_right ? kColumns / 2 : 0;
  double inside = 0.0;
  double seen = 0.0;
  for (int row = first_row; row < first_row + kRows / 2; ++row) {
    for (int column = first_column; column < first_column + kColumns / 2; ++column) {
      if (!is_inside(row, column)) continue;
      inside += 1.0;
      seen += is_seen(row, column) ? 1.0 : 0.0;
    }
  }
  return seen / inside;
}

/// The quarters have as many cells.
double CameraCoverage::picture() const {
  return 0.25 * (picture_of(false, false) + picture_of(false, true) + picture_of(true, false) +
                 picture_of(true, true));
}

Eigen::Vector3d CameraCoverage::rate_rms_radps() const {
  return (rate_square_sum_ / std::max(1.0, samples_)).cwiseSqrt();
}

double CameraCoverage::share() const {
  return std::min({1.0, picture() / kWholePicture, seen_s_ / kEnoughSeconds,
                   rate_rms_radps().minCoeff() / kEnoughTurning});
}

std::vector<std::string> CameraCoverage::missing() const {
  std::vector<std::string> missing;
  if (share() >= 1.0) return missing;
  if (boards_.empty()) {
    return {
        "no board is recognized: are the patterns in swarm.members, are the boards in view, is "
        "the exposure right?"};
  }
  for (const bool is_low : {false, true}) {
    for (const bool is_right : {false, true}) {
      if (picture_of(is_low, is_right) < kWholePicture) {
        missing.push_back(fmt::format("turn until a board crosses all of the {} {} quarter",
                                      is_low ? "lower" : "upper", is_right ? "right" : "left"));
      }
    }
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (rate_rms_radps()(axis) < kEnoughTurning) {
      missing.push_back(fmt::format("turn more about {}: {:.0f} of {:.0f} deg/s",
                                    kAxisNames.at(static_cast<std::size_t>(axis)),
                                    kDegPerRad * rate_rms_radps()(axis),
                                    kDegPerRad * kEnoughTurning));
    }
  }
  if (seen_s_ < kEnoughSeconds) {
    missing.push_back(fmt::format("{:.0f} more seconds with a board in view",
                                  std::ceil(kEnoughSeconds - seen_s_)));
  }
  return missing;
}

std::string coverage_text(const CameraCoverage& coverage) {
  constexpr int kBar = 30;
  std::string text = "where boards were seen in the picture (# yes, . not yet)\n\n";
  for (int row = 0; row < CameraCoverage::kRows; ++row)
    text += "  " + line_of(coverage, row) + "\n";
  const auto done = static_cast<int>(coverage.share() * kBar);
  text += fmt::format(
      "\nboards {}; in view for {:.0f} s\n[{}{}] {:.0f} %\n\n", board_list(coverage),
      coverage.seen_s(), std::string(static_cast<std::size_t>(done), '#'),
      std::string(static_cast<std::size_t>(kBar - done), '.'), 100.0 * coverage.share());
  for (const std::string& line : coverage.missing()) text += "- " + line + "\n";
  return text;
}

std::string coverage_json(const CameraCoverage& coverage) {
  Json json{{"share", coverage.share()},   {"picture", coverage.picture()},
            {"seen_s", coverage.seen_s()}, {"boards", Json::array()},
            {"cells", Json::array()},      {"missing", coverage.missing()}};
  const Eigen::Vector3d rate = coverage.rate_rms_radps();
  json["rate_rms_radps"] = {rate.x(), rate.y(), rate.z()};
  for (const RobotId id : coverage.boards()) json["boards"].push_back(id.value);
  for (int row = 0; row < CameraCoverage::kRows; ++row)
    json["cells"].push_back(line_of(coverage, row));
  return json_line(json);
}

}  // namespace crepes
