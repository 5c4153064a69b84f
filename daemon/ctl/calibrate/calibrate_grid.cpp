#include "daemon/ctl/calibrate/calibrate_grid.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "daemon/ctl/calibrate/camchain.hpp"
#include "daemon/ctl/calibrate/grid_report.hpp"
#include "drivers/base/number_text.hpp"
#include "drivers/camera/image_folder.hpp"
#include "drivers/dataset/picture_list.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/grid/grid_calibration.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/separate_lights.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr double kShareOfReading = 0.4;
constexpr double kAnyGridFov_deg = 180.0;
constexpr std::size_t kMostPictures = 150;  // evenly spaced ones of a film
constexpr double kFilmRate_hz = 30.0;       // gives pictures without a stamp an order

/// The lights of all pictures, which are of one size.
struct GridPictures {
  std::vector<GridPicture> pictures;
  std::array<int, 2> resolution{};
  std::vector<std::string> unreadable;
};

/// The pictures of `source`, or of its first camera if it is a robot's folder.
Result<std::vector<RecordedPicture>> grid_files(const fs::path& source) {
  auto files = list_pictures(source, kFilmRate_hz);
  for (const fs::path& folder : {source / "cam0", source / "cam0" / "data", source / "data"}) {
    std::error_code ignored;
    if (!files && fs::exists(folder, ignored)) files = list_pictures(folder, kFilmRate_hz);
  }
  if (!files || files->size() <= kMostPictures) return files;
  std::vector<RecordedPicture> some;
  for (std::size_t k = 0; k < kMostPictures; ++k)
    some.push_back((*files)[k * files->size() / kMostPictures]);
  return some;
}

Result<GridPictures> read_pictures(const CalibrateGridOptions& options) {
  const auto files = grid_files(options.pictures);
  if (!files) return tl::unexpected(files.error());
  GridPictures found;
  for (const RecordedPicture& file : *files) {
    const std::string name = file.file.filename().string();
    const auto picture = read_gray_image(file.file);
    if (!picture) {
      found.unreadable.push_back(picture.error().message);
      continue;
    }
    const std::array<int, 2> resolution{picture->width, picture->height};
    if (found.pictures.empty()) found.resolution = resolution;
    if (resolution != found.resolution)
      return fail(ErrorCode::kFormat,
                  fmt::format("{} is {}x{}, those before it are {}x{}: all pictures must be of one "
                              "camera, as it takes them",
                              file.file.string(), resolution[0], resolution[1], found.resolution[0],
                              found.resolution[1]));
    GridPicture& next = found.pictures.emplace_back();
    next.name = name;
    for (const Spot& spot : separate_lights({.pixels = picture->pixels.data(),
                            .width = picture->width,
                            .height = picture->height,
                            .stride = picture->width}))
      next.lights.emplace_back(spot.u_px, spot.v_px);
    if (options.on_progress)
      options.on_progress(kShareOfReading * static_cast<double>(found.pictures.size()) /
                          static_cast<double>(files->size()));
  }
  if (found.pictures.empty())
    return fail(ErrorCode::kFormat, options.pictures.string() + ": no picture can be read");
  return found;
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
  const auto read = read_pictures(options);
  if (!read) return tl::unexpected(read.error());
  GridCalibration found = calibrate_grid(
      read->pictures,
      {.shape = options.grid,
       .resolution = read->resolution,
       .kind = options.kannala_brandt ? LensKind::kKannalaBrandt : LensKind::kDoubleSphere,
       .fov_rad = radians(options.fov_deg.value_or(kAnyGridFov_deg)),
       .on_progress = [&](double done) {
         if (options.on_progress)
           options.on_progress(kShareOfReading + (1.0 - kShareOfReading) * done);
       }});
  found.warnings.insert(found.warnings.end(), read->unreadable.begin(), read->unreadable.end());
  CalibrationReport report;
  report.reasons = found.refusals;
  if (found.refusals.empty()) {
    const auto written =
        write_text_file(options.out, camchain_text(found.lens.calibration(read->resolution),
                                                   Mounting::kUnknown, "camera --grid"));
    if (!written) return tl::unexpected(written.error());
  }
  if (options.json) {
    report.text = grid_json(found, read->pictures);
  } else if (found.refusals.empty()) {
    report.text = grid_text(found, read->pictures.size(), options.out);
  }
  return report;
}

}  // namespace crepes
