#include "estimator/calibration/grid/grid_refusal.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "estimator/calibration/number_text.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::size_t kLeastViews = 6;
constexpr std::size_t kGoodViews = 15;
constexpr double kLeastShareOfPictures = 1.0 / 3.0;
constexpr double kLeastTilt_rad = radians(12.0);
constexpr double kMostLensSigma_px = 1.0;
constexpr double kGoodLensSigma_px = 0.3;
constexpr double kMostSpotSigma_px = 2.0;
constexpr double kGoodSpotSigma_px = 0.6;
constexpr double kMostOutliers = 0.2;
constexpr double kLeastRim = 0.5;  // of half the shorter side
constexpr double kGoodRim = 0.8;
constexpr double kRimRatio = 2.0;
constexpr double kHeldOutRatio = 1.5;

std::string count_of(std::size_t part, std::size_t all) {
  return std::to_string(part) + " of " + std::to_string(all) + " pictures";
}

/// "a.png, b.png and 3 others"
std::string names_without_grid(const std::vector<GridPicture>& pictures,
                               const GridCalibration& result) {
  constexpr std::size_t kMostNames = 5;
  std::string text;
  std::size_t count = 0;
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    if (std::ranges::find(result.views, k) != result.views.end()) continue;
    if (count++ < kMostNames) text += (text.empty() ? "" : ", ") + pictures[k].name;
  }
  if (count > kMostNames) text += " and " + std::to_string(count - kMostNames) + " others";
  return text;
}

void check_quarters(const GridCalibration& found, const GridSettings& settings,
                    std::vector<std::string>& warnings) {
  constexpr std::array<std::string_view, 4> kQuarters{"upper left", "upper right", "lower left",
                                                      "lower right"};
  constexpr double kLeast = 0.02;
  std::array<double, 4> counts{};
  double all = 0.0;
  for (const GridView& view : found.poses) {
    for (const GridLed& led : view.leds) {
      const std::size_t right = led.uv.x() > 0.5 * settings.resolution[0] ? 1 : 0;
      const std::size_t low = led.uv.y() > 0.5 * settings.resolution[1] ? 1 : 0;
      counts.at(2 * low + right) += 1.0;
      all += 1.0;
    }
  }
  for (std::size_t q = 0; q < counts.size(); ++q)
    if (counts.at(q) < kLeast * all)
      warnings.push_back("the grid was never in the " + std::string(kQuarters.at(q)) +
                         " quarter of the picture: the lens is not known there");
}

void check_rim(const GridFit& fit, const GridSettings& settings, GridCalibration& result) {
  const double half_px = 0.5 * std::min(settings.resolution[0], settings.resolution[1]);
  const std::string reach = "LEDs reach " + number_text(result.seen_px, 0) +
                            " px from the center (" + number_text(result.seen_rad * kDegPerRad, 0) +
                            " deg), half the picture is " + number_text(half_px, 0) + " px";
  if (result.seen_px < kLeastRim * half_px) {
    result.refusals.push_back("the rim of the picture was never seen: " + reach);
  } else if (result.seen_px < kGoodRim * half_px) {
    result.warnings.push_back(
        "the rim of the picture was never seen, the lens is not known there: " + reach);
  }
  std::array<double, 2> square{};
  std::array<double, 2> count{};
  std::size_t i = 0;
  for (const GridView& view : fit.views) {
    for (const GridLed& led : view.leds) {
      const SightingResidual& residual = fit.residuals[i++];
      if (is_outlier(residual, fit.sigma_px)) continue;
      const std::size_t ring =
          (led.uv - fit.lens.center()).norm() > kGoodRim * result.seen_px ? 1 : 0;
      square.at(ring) += residual.uv.squaredNorm();
      count.at(ring) += 2.0;
    }
  }
  constexpr double kLeast = 50.0;
  if (count[0] < kLeast || count[1] < kLeast) return;
  const double inner = std::sqrt(square[0] / count[0]);
  const double outer = std::sqrt(square[1] / count[1]);
  if (outer > kRimRatio * inner && outer > kGoodLensSigma_px)
    result.warnings.push_back("residuals grow to the rim (" + number_text(outer, 2) +
                              " px against " + number_text(inner, 2) +
                              " px): this lens is not quite of this model; try the other one");
}

}  // namespace

void judge_views(const std::vector<GridPicture>& pictures, const GridSettings& settings,
                 GridCalibration& result) {
  const std::size_t missing = pictures.size() - result.views.size();
  const std::string grid = "a grid of " + std::to_string(settings.shape.rows) + "x" +
                           std::to_string(settings.shape.columns) + " LEDs";
  const bool is_rare = static_cast<double>(result.views.size()) <
                       kLeastShareOfPictures * static_cast<double>(pictures.size());
  if (missing > 0)
    (is_rare ? result.refusals : result.warnings)
        .push_back(grid + " was not found in " + count_of(missing, pictures.size()) + ": " +
                   names_without_grid(pictures, result));
  if (result.views.size() < kLeastViews) {
    result.refusals.push_back("the grid is seen in " +
                              count_of(result.views.size(), pictures.size()) + "; at least " +
                              std::to_string(kLeastViews) + " are needed, 30 are better");
  } else if (result.views.size() < kGoodViews) {
    result.warnings.push_back("the grid is seen in " + std::to_string(result.views.size()) +
                              " pictures only; 30 are better");
  }
}

void judge_grid(const GridFit& fit, const std::vector<GridPicture>& pictures,
                const GridSettings& settings, GridCalibration& result) {
  judge_views(pictures, settings, result);
  if (result.tilt_rad < kLeastTilt_rad)
    result.refusals.push_back(
        "the grid faced the camera in all pictures (at most " +
        number_text(result.tilt_rad * kDegPerRad, 0) +
        " deg aslant): focal length and distance cannot be told apart; tilt it by 30 to 50 deg, "
        "to all sides");
  if (fit.covariance.size() == 0)
    result.refusals.emplace_back("the pictures do not determine the lens");
  if (result.spot_sigma_px > kMostSpotSigma_px)
    result.refusals.push_back(
        "residuals of " + number_text(result.spot_sigma_px, 2) +
        " px: the grid is not flat or its LEDs not evenly spaced, or the pictures are blurred");
  else if (result.spot_sigma_px > kGoodSpotSigma_px)
    result.warnings.push_back("residuals of " + number_text(result.spot_sigma_px, 2) +
                              " px: is the grid flat and evenly spaced?");
  if (!fit.has_converged)
    result.warnings.emplace_back("the solver had not converged when it stopped");
  if (result.outliers > kMostOutliers)
    result.refusals.push_back(number_text(100.0 * result.outliers, 0) +
                              " % of the LEDs contradict the others: is the grid flat, and are "
                              "rows and columns as said?");
  if (result.lens_sigma_px > kMostLensSigma_px)
    result.refusals.push_back("the lens remains uncertain by " +
                              number_text(result.lens_sigma_px, 2) +
                              " px (one sigma, RMS over what was seen): more pictures, nearer, "
                              "tilted to all sides");
  else if (result.lens_sigma_px > kGoodLensSigma_px)
    result.warnings.push_back("the lens is known to " + number_text(result.lens_sigma_px, 2) +
                              " px only: more pictures, nearer and tilted, make it better");
  check_quarters(result, settings, result.warnings);
  check_rim(fit, settings, result);
  if (result.held_out_px > kHeldOutRatio * result.rms_px)
    result.warnings.push_back("held-out views fit worse (" + number_text(result.held_out_px, 2) +
                              " px) than the others (" + number_text(result.rms_px, 2) + " px)");
}

}  // namespace crepes
