#include "daemon/ctl/calibrate/calibrate_grid.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/calibrate/camchain.hpp"
#include "daemon/ctl/calibrate/camera_report.hpp"
#include "daemon/ctl/calibrate/grid_report.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "drivers/base/number_text.hpp"
#include "drivers/camera/image_folder.hpp"
#include "drivers/dataset/picture_list.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/grid/grid_calibration.hpp"
#include "estimator/calibration/grid/grid_camera.hpp"
#include "estimator/calibration/imu/vibration.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/separate_lights.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr double kShareOfReading = 0.4;
constexpr double kShareOfLens = 0.7;
constexpr double kAnyGridFov_deg = 180.0;
constexpr std::size_t kMostStills = 150;  // evenly spaced ones of more
constexpr double kFilmRate_hz = 30.0;     // gives pictures without a stamp an order
constexpr Duration kFilmPeriod = std::chrono::milliseconds(80);  // more say little more
constexpr std::size_t kMostOfFilm = 1000;

/// The lights of all pictures, which are of one size.
struct GridPictures {
  std::vector<GridPicture> pictures;
  std::vector<Timestamp> stamps;  ///< of each
  std::array<int, 2> resolution{};
  std::vector<std::string> unreadable;
};

/// What a robot's folder says beside its pictures.
struct GridBody {
  std::vector<ImuSample> imu;
  ImuNoise noise;
  Eigen::Vector3d p_B_C = Eigen::Vector3d::Zero();
};

/// Empty if `source` has no inertial samples: then it is a folder of pictures alone. A robot's
/// folder may lack its configuration.
Result<std::optional<GridBody>> read_body(const fs::path& source, DatasetFaults& faults) {
  const fs::path samples = source / "imu0" / "data.csv";
  std::error_code ignored;
  if (!fs::exists(samples, ignored)) return std::nullopt;
  auto imu = load_imu(samples, faults);
  if (!imu) return tl::unexpected(imu.error());
  GridBody body;
  body.imu = std::move(*imu);
  const fs::path file = source / "crepesd.yaml";
  if (!fs::exists(file, ignored)) return body;
  const auto config = load_config(file);
  if (!config) return tl::unexpected(config.error());
  body.noise = config->imu.noise;
  if (!config->cameras.empty())
    body.p_B_C = config->cameras.front().calibration.T_cam_imu.inverse().p;
  return body;
}

/// So many, evenly spaced.
template <class Value>
std::vector<Value> some_of(const std::vector<Value>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<Value> some;
  for (std::size_t k = 0; k < most; ++k) some.push_back(all[k * all.size() / most]);
  return some;
}

std::vector<RecordedPicture> film_of(const std::vector<RecordedPicture>& files) {
  std::vector<RecordedPicture> film;
  for (const RecordedPicture& file : files) {
    if (film.size() < kMostOfFilm &&
        (film.empty() || file.stamp >= film.back().stamp + kFilmPeriod))
      film.push_back(file);
  }
  return film;
}

/// The pictures of `source`, or of its first camera if it is a robot's folder.
Result<std::vector<RecordedPicture>> grid_files(const fs::path& source) {
  auto files = list_pictures(source, kFilmRate_hz);
  for (const fs::path& folder : {source / "cam0", source / "cam0" / "data", source / "data"}) {
    std::error_code ignored;
    if (!files && fs::exists(folder, ignored)) files = list_pictures(folder, kFilmRate_hz);
  }
  return files;
}

Result<GridPictures> read_pictures(const CalibrateGridOptions& options, bool is_film) {
  const auto all = grid_files(options.pictures);
  if (!all) return tl::unexpected(all.error());
  const auto files = is_film ? film_of(*all) : some_of(*all, kMostStills);
  GridPictures found;
  for (const RecordedPicture& file : files) {
    const std::string name = file.file.filename().string();
    const auto picture = read_gray_image(file.file);
    if (!picture) {
      found.unreadable.push_back(picture.error().message);
      continue;
    }
    const std::array<int, 2> resolution{picture->width, picture->height};
    if (found.pictures.empty()) found.resolution = resolution;
    if (resolution != found.resolution) {
      return fail(ErrorCode::kFormat,
                  fmt::format("{} is {}x{}, those before it are {}x{}: all pictures must be of one "
                              "camera, as it takes them",
                              file.file.string(), resolution[0], resolution[1], found.resolution[0],
                              found.resolution[1]));
    }
    GridPicture& next = found.pictures.emplace_back();
    next.name = name;
    found.stamps.push_back(file.stamp);
    for (const Spot& spot : separate_lights({.pixels = picture->pixels.data(),
                            .width = picture->width,
                            .height = picture->height,
                            .stride = picture->width}))
      next.lights.emplace_back(spot.u_px, spot.v_px);
    if (options.on_progress) {
      options.on_progress(kShareOfReading * static_cast<double>(found.pictures.size()) /
                          static_cast<double>(files.size()));
    }
  }
  if (found.pictures.empty())
    return fail(ErrorCode::kFormat, options.pictures.string() + ": no picture can be read");
  return found;
}

/// The part of the work between two shares of all.
std::function<void(double)> part_of(const CalibrateGridOptions& options, double begin, double end) {
  return [&options, begin, end](double done) {
    if (options.on_progress) options.on_progress(begin + (end - begin) * done);
  };
}

GridCalibration lens_of(const CalibrateGridOptions& options, const GridPictures& read,
                        LensKind kind, double end) {
  GridCalibration found =
      calibrate_grid(some_of(read.pictures, kMostStills),
                     {.shape = options.grid,
                      .resolution = read.resolution,
                      .kind = kind,
                      .fov_rad = radians(options.fov_deg.value_or(kAnyGridFov_deg)),
                      .on_progress = part_of(options, kShareOfReading, end)});
  found.warnings.insert(found.warnings.end(), read.unreadable.begin(), read.unreadable.end());
  return found;
}

/// The lens alone.
Result<void> calibrate_stills(const CalibrateGridOptions& options, const GridPictures& read,
                              CalibrationReport& report) {
  const GridCalibration found =
      lens_of(options, read,
              options.kannala_brandt ? LensKind::kKannalaBrandt : LensKind::kDoubleSphere, 1.0);
  report.reasons = found.refusals;
  if (found.refusals.empty()) {
    auto written =
        write_text_file(options.out, camchain_text(found.lens.calibration(read.resolution),
                                                   Mounting::kUnknown, "camera --grid"));
    if (!written) return written;
  }
  if (options.json) {
    report.text = grid_json(found, read.pictures);
  } else if (found.refusals.empty()) {
    report.text = grid_text(found, read.pictures.size(), options.out);
  }
  return {};
}

/// First the lens, with which the LEDs are found; then all at once.
Result<void> calibrate_film(const CalibrateGridOptions& options, const GridPictures& read,
                            const GridBody& body, CalibrationReport& report) {
  const GridCalibration lens = lens_of(options, read, LensKind::kDoubleSphere, kShareOfLens);
  CameraBatchResult found;
  if (lens.refusals.empty()) {
    std::vector<GridFrame> frames;
    for (std::size_t k = 0; k < read.pictures.size(); ++k)
      frames.push_back({read.stamps[k], read.pictures[k].lights});
    found = calibrate_grid_camera(body.imu, frames, options.grid,
                                  {.width = read.resolution[0],
                                   .height = read.resolution[1],
                                   .lens = lens.lens.numbers,
                                   .p_B_C = body.p_B_C,
                                   .noise = noise_with_vibration(body.noise, body.imu, 8),
                                   .on_progress = part_of(options, kShareOfLens, 1.0)});
  }
  if (lens.refusals.empty() && !found.refusals.empty()) {
    found.refusals.push_back(
        fmt::format("the lens by itself could be calibrated: give {} instead of the whole folder",
                    (options.pictures / "cam0").string()));
  }
  found.refusals.insert(found.refusals.begin(), lens.refusals.begin(), lens.refusals.end());
  found.warnings.insert(found.warnings.begin(), lens.warnings.begin(), lens.warnings.end());
  return report_camera(
      found,
      {.words = "LEDs", .key = "leds", .count = static_cast<std::size_t>(options.grid.leds())},
      {.out = options.out,
       .resolution = read.resolution,
       .kannala_brandt = options.kannala_brandt,
       .json = options.json},
      report);
}

}  // namespace

Result<GridShape> parse_grid(const std::string& text, double pitch_m) {
  constexpr int kLeast = 3;
  constexpr int kMost = 40;
  const std::size_t cross = text.find('x');
  GridShape shape{.rows = 0, .columns = 0, .pitch_m = pitch_m};
  const bool is_read =
      cross != std::string::npos && parse_number(text.substr(0, cross), shape.rows).empty() &&
      parse_number(text.substr(cross + 1), shape.columns).empty() &&
      std::min(shape.rows, shape.columns) >= kLeast && std::max(shape.rows, shape.columns) <= kMost;
  if (is_read) return shape;
  return fail(ErrorCode::kUsage,
              fmt::format("--grid: '{}' is no number of rows and columns, {} to {}, as in 5x7",
                          text, kLeast, kMost));
}

Result<CalibrationReport> calibrate_grid(const CalibrateGridOptions& options) {
  if (const auto free = check_results({options.out}, "camera", options.force); !free)
    return tl::unexpected(free.error());
  CalibrationReport report;
  const auto body = read_body(options.pictures, report.faults);
  if (!body) return tl::unexpected(body.error());
  const auto read = read_pictures(options, body->has_value());
  if (!read) return tl::unexpected(read.error());
  const Result<void> done = *body ? calibrate_film(options, *read, **body, report)
                                  : calibrate_stills(options, *read, report);
  if (!done) return tl::unexpected(done.error());
  return report;
}

}  // namespace crepes
