#include "estimator/calibration/grid/grid_calibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/simulated_grid.hpp"

namespace crepes::grid_calibration_test {
namespace {

using simulated::SeenGrid;
using simulated::SeenLed;

constexpr double kNoise_px = 0.15;

std::vector<GridPicture> pictures_of(const std::vector<SeenGrid>& grids, std::uint64_t seed) {
  std::mt19937_64 dice(seed);
  std::normal_distribution<double> noise(0.0, kNoise_px);
  std::vector<GridPicture> pictures;
  for (const SeenGrid& grid : grids) {
    GridPicture& picture = pictures.emplace_back();
    picture.name = "picture" + std::to_string(pictures.size());
    for (const SeenLed& led : grid.leds)
      picture.lights.emplace_back(led.uv + Eigen::Vector2d(noise(dice), noise(dice)));
  }
  return pictures;
}

GridCalibration calibrated(const std::vector<GridPicture>& pictures,
                           LensKind kind = LensKind::kDoubleSphere, double fov_deg = 180.0) {
  return calibrate_grid(pictures, {.shape = simulated::five_by_seven(),
                                   .resolution = {simulated::kGridWidth, simulated::kGridHeight},
                                   .kind = kind,
                                   .fov_rad = radians(fov_deg),
                                   .on_progress = {}});
}

std::string first_of(const std::vector<std::string>& reasons) {
  return reasons.empty() ? "" : reasons.front();
}

TEST(GridCalibration, FindsTheLensFromTheResolutionAndARoughFieldOfView) {
  const auto found = calibrated(pictures_of(simulated::seen_grids(1, 40, {}), 1));

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_GE(found.views.size(), 34U);
  EXPECT_NEAR(found.rms_px, kNoise_px, 0.02);
  EXPECT_NEAR(found.held_out_px, kNoise_px, 0.03);
  EXPECT_GT(found.seen_rad, radians(80.0));
  // Three sigmas of its own.
  EXPECT_LT(simulated::shape_error_px(found.lens, simulated::grid_camera(), 85.0),
            3.0 * found.lens_sigma_px);
  EXPECT_LT(found.lens_sigma_px, 0.15);
}

// Two Double Spheres with other numbers may see the same, so that the numbers' own sigmas hold only
// near one of them. What counts is where the lens puts directions in the picture.
TEST(GridCalibration, ItsSigmaIsHonest) {
  double squared = 0.0;
  constexpr int kTrials = 6;
  for (int seed = 0; seed < kTrials; ++seed) {
    const auto found =
        calibrated(pictures_of(simulated::seen_grids(static_cast<std::uint64_t>(seed) + 10, 25, {}),
                               static_cast<std::uint64_t>(seed)));
    ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
    const double error_px = simulated::shape_error_px(found.lens, simulated::grid_camera(), 85.0);
    squared += std::pow(error_px / found.lens_sigma_px, 2) / kTrials;
  }

  // Some five degrees of freedom a trial: of 30, 99.9 % lie within 0.37 and 2.
  EXPECT_GT(squared, 0.37);
  EXPECT_LT(squared, 2.0);
}

TEST(GridCalibration, StartsFromAFieldOfViewThatIsFarOff) {
  const auto pictures = pictures_of(simulated::seen_grids(3, 30, {}), 3);
  for (const double fov_deg : {110.0, 220.0}) {
    const auto found = calibrated(pictures, LensKind::kDoubleSphere, fov_deg);

    ASSERT_TRUE(found.refusals.empty()) << fov_deg << ": " << found.refusals.front();
    EXPECT_LT(simulated::shape_error_px(found.lens, simulated::grid_camera(), 85.0), 0.2)
        << fov_deg;
  }
}

TEST(GridCalibration, FitsKannalaAndBrandtsModelItself) {
  const auto found =
      calibrated(pictures_of(simulated::seen_grids(4, 40, {}), 4), LensKind::kKannalaBrandt);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_LT(simulated::shape_error_px(found.lens, simulated::grid_camera(), 80.0), 0.25);
}

TEST(GridCalibration, LeavesOutLedsThatAreSeenInTheWrongPlace) {
  auto pictures = pictures_of(simulated::seen_grids(5, 40, {}), 5);
  for (std::size_t k = 0; k < pictures.size(); ++k)
    for (std::size_t i = k % 7; i < pictures[k].lights.size(); i += 12)
      pictures[k].lights[i] += Eigen::Vector2d(1.5, -2.0);

  const auto found = calibrated(pictures);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_GT(found.outliers, 0.03);
  EXPECT_LT(simulated::shape_error_px(found.lens, simulated::grid_camera(), 85.0), 0.25);
}

TEST(GridCalibration, RefusesTooFewViews) {
  const auto found = calibrated(pictures_of(simulated::seen_grids(6, 4, {}), 6));

  ASSERT_FALSE(found.refusals.empty());
  EXPECT_NE(first_of(found.refusals).find("of 4 pictures"), std::string::npos)
      << first_of(found.refusals);
}

TEST(GridCalibration, RefusesAGridThatAlwaysFacedTheCamera) {
  const auto found = calibrated(
      pictures_of(simulated::seen_grids(7, 30, {.least_tilt_deg = 0.0, .most_tilt_deg = 6.0}), 7));

  ASSERT_FALSE(found.refusals.empty());
  EXPECT_NE(first_of(found.refusals).find("faced the camera"), std::string::npos)
      << first_of(found.refusals);
}

TEST(GridCalibration, RefusesALensOfWhichTheRimWasNeverSeen) {
  GridCalibration found = calibrated(pictures_of(
      simulated::seen_grids(
          8, 30, {.most_off_axis_deg = 8.0, .least_distance_m = 0.6, .most_distance_m = 1.0}),
      8));

  ASSERT_FALSE(found.refusals.empty());
  EXPECT_TRUE(std::ranges::any_of(found.refusals, [](const std::string& reason) {
    return reason.find("the rim of the picture was never seen") != std::string::npos;
  })) << first_of(found.refusals);
}

TEST(GridCalibration, NamesThePicturesInWhichItFoundNoGrid) {
  auto pictures = pictures_of(simulated::seen_grids(9, 30, {}), 9);
  for (const std::size_t k : {3U, 8U}) {
    pictures[k].lights.resize(9);
    pictures[k].name = "empty" + std::to_string(k);
  }

  const auto found = calibrated(pictures);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_TRUE(std::ranges::any_of(found.warnings, [](const std::string& warning) {
    return warning.find("was not found in") != std::string::npos &&
           warning.find("empty3") != std::string::npos;
  })) << first_of(found.warnings);
}

}  // namespace
}  // namespace crepes::grid_calibration_test
