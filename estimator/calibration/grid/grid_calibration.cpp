#include "estimator/calibration/grid/grid_calibration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "estimator/calibration/camera/pixel_derivatives.hpp"
#include "estimator/calibration/grid/grid_refusal.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kMostContradictions = 0.4;  // of a view's LEDs: its order is wrong
constexpr std::size_t kHeldOutEvery = 5;

/// Views of pictures, and the numbers of those pictures.
struct Views {
  std::vector<std::size_t> pictures;
  std::vector<GridView> views;
};

using Orders = std::vector<std::vector<GridLed>>;

std::size_t leds_of(const Orders& orders) {
  std::size_t count = 0;
  for (const auto& leds : orders) count += leds.size();
  return count;
}

/// By the lens with which most LEDs are found.
std::vector<GridLed> best_order(const GridPicture& picture, const std::vector<GridLens>& lenses,
                                const GridShape& shape) {
  std::vector<GridLed> best;
  for (const GridLens& lens : lenses) {
    if (best.size() == static_cast<std::size_t>(shape.leds())) break;
    auto leds = find_grid(picture.lights, lens, shape);
    if (leds.size() > best.size()) best = std::move(leds);
  }
  return best;
}

Orders orders_with(const std::vector<GridPicture>& pictures, const std::vector<GridLens>& lenses,
                   const GridShape& shape, const Progress& progress) {
  Orders orders;
  for (const GridPicture& picture : pictures) {
    orders.push_back(best_order(picture, lenses, shape));
    progress(static_cast<double>(orders.size()) / static_cast<double>(pictures.size()));
  }
  return orders;
}

Views views_with(const Orders& orders, const GridLens& lens, const GridShape& shape) {
  Views found;
  for (std::size_t k = 0; k < orders.size(); ++k) {
    const auto T_C_G = grid_pose(orders[k], lens, shape);
    if (!T_C_G) continue;
    found.pictures.push_back(k);
    found.views.push_back({orders[k], *T_C_G});
  }
  return found;
}

/// The starting lens that explains most: focal lengths of half to twice that of the field of view.
std::optional<GridLens> first_lens(const Orders& orders, const GridSettings& settings) {
  constexpr std::array kScales{1.0, 0.75, 1.35, 0.55, 1.8};
  std::optional<GridLens> best;
  double least_px = 0.0;
  std::size_t most = 0;
  for (const double scale : kScales) {
    const GridLens start =
        generic_grid_lens(settings.kind, settings.resolution, settings.fov_rad, scale);
    Views found = views_with(orders, start, settings.shape);
    if (found.views.empty()) continue;
    const std::size_t count = found.views.size();
    const GridFit fit = try_grid(start, std::move(found.views), settings.shape);
    const bool is_better = count > most || (count == most && fit.sigma_px < least_px);
    if (best && !is_better) continue;
    best = fit.lens;
    least_px = fit.sigma_px;
    most = count;
  }
  return best;
}

/// Drops the views of which many LEDs contradict the others. Whether there were any.
bool drop_contradictions(const GridFit& fit, Views& found) {
  Views kept;
  std::size_t i = 0;
  for (std::size_t k = 0; k < fit.views.size(); ++k) {
    const GridView& view = fit.views[k];
    std::size_t bad = 0;
    for (std::size_t j = 0; j < view.leds.size(); ++j)
      bad += is_outlier(fit.residuals[i++], fit.sigma_px) ? 1 : 0;
    if (static_cast<double>(bad) > kMostContradictions * static_cast<double>(view.leds.size()))
      continue;
    kept.pictures.push_back(found.pictures[k]);
    kept.views.push_back(view);
  }
  const bool is_changed = kept.views.size() != found.views.size();
  found = std::move(kept);
  return is_changed;
}

/// Lens and poses of all views that agree.
GridFit fit_of(const GridLens& lens, const GridShape& shape, Views& found) {
  GridFit fit = fit_grid(lens, found.views, shape, GridUnknowns::kLensAndPoses);
  if (drop_contradictions(fit, found))
    fit = fit_grid(fit.lens, found.views, shape, GridUnknowns::kLensAndPoses);
  found.views = fit.views;
  return fit;
}

/// RMS of a coordinate, outliers left out.
double rms_of(const std::vector<SightingResidual>& residuals, double sigma_px) {
  double sum = 0.0;
  double count = 0.0;
  for (const SightingResidual& residual : residuals) {
    if (is_outlier(residual, sigma_px)) continue;
    sum += residual.uv.squaredNorm();
    count += 2.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

/// Every fifth view, posed in a lens that is fitted to the others.
double held_out_rms(const GridFit& fit, const GridShape& shape) {
  std::vector<GridView> fitted;
  std::vector<GridView> held_out;
  for (std::size_t k = 0; k < fit.views.size(); ++k)
    (k % kHeldOutEvery == kHeldOutEvery - 1 ? held_out : fitted).push_back(fit.views[k]);
  if (held_out.empty()) return 0.0;
  const GridFit others = fit_grid(fit.lens, std::move(fitted), shape, GridUnknowns::kLensAndPoses);
  return rms_of(fit_grid(others.lens, std::move(held_out), shape, GridUnknowns::kPoses).residuals,
                fit.sigma_px);
}

/// RMS of the pixels that the lens errs by within `radius_px` of its center, after the small
/// rotation that is best for each error.
double lens_sigma_px(const GridLens& lens, const Eigen::MatrixXd& covariance, double radius_px) {
  const std::vector<Eigen::Vector2d> points = points_of_circle(lens.center(), radius_px);
  const auto rows = 2 * static_cast<Eigen::Index>(points.size());
  const Eigen::Index n = lens.numbers.size();
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, n);
  Eigen::MatrixXd Q = Eigen::MatrixXd::Zero(rows, 3);
  int count = 0;
  for (const Eigen::Vector2d& uv : points) {
    const auto u_C = lens.direction(uv);
    if (!u_C) continue;
    const auto derivatives = pixel_derivatives(n + 3, 1e-5, [&](Eigen::Index i, double step) {
      GridLens other = lens;
      Eigen::Vector3d turn = Eigen::Vector3d::Zero();
      if (i < n) other.numbers[i] += step;
      if (i >= n) turn[i - n] = step;
      return other.project(so3_exp(turn) * *u_C);
    });
    if (!derivatives) continue;
    J.middleRows<2>(2 * count) = derivatives->leftCols(n);
    Q.middleRows<2>(2 * count) = derivatives->rightCols<3>();
    ++count;
  }
  if (count == 0) return 0.0;
  const Eigen::MatrixXd turns = Eigen::Matrix3d(Q.transpose() * Q).ldlt().solve(Q.transpose() * J);
  const Eigen::MatrixXd shape = J - Q * turns;
  return std::sqrt((shape * covariance * shape.transpose()).trace() / count);
}

/// Angle between the line of sight to the grid's middle and its normal.
double tilt_of(const GridView& view, const GridShape& shape) {
  const Eigen::Vector3d middle(0.5 * shape.pitch_m * (shape.columns - 1),
                               0.5 * shape.pitch_m * (shape.rows - 1), 0.0);
  const Eigen::Vector3d toward = (view.T_C_G * middle).normalized();
  const double cosine = std::abs(toward.dot(view.T_C_G.q * Eigen::Vector3d::UnitZ()));
  return std::acos(std::min(1.0, cosine));
}

double third_largest(std::vector<double> values) {
  if (values.size() < 3) return 0.0;
  std::ranges::nth_element(values, values.begin() + 2, std::ranges::greater{});
  return values[2];
}

std::vector<BoardSighting> sightings_of(const std::vector<GridView>& views) {
  std::vector<BoardSighting> sightings;
  for (const GridView& view : views)
    for (const GridLed& led : view.leds)
      sightings.push_back({.stamp = {}, .board = 0, .uv = led.uv});
  return sightings;
}

void describe(const GridFit& fit, const GridSettings& settings, GridCalibration& result) {
  result.lens = fit.lens;
  result.covariance = fit.covariance;
  result.spot_sigma_px = fit.sigma_px;
  result.rms_px = rms_of(fit.residuals, fit.sigma_px);
  result.outliers = fit.outliers;
  result.poses = fit.views;
  const std::vector<BoardSighting> sightings = sightings_of(fit.views);
  result.map = map_of(sightings, fit.residuals, fit.sigma_px, settings.resolution[0],
                      settings.resolution[1]);
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (is_outlier(fit.residuals[i], fit.sigma_px)) continue;
    const auto u_C = fit.lens.direction(sightings[i].uv);
    if (u_C)
      result.seen_rad = std::max(result.seen_rad, std::atan2(u_C->head<2>().norm(), u_C->z()));
    result.seen_px = std::max(result.seen_px, (sightings[i].uv - fit.lens.center()).norm());
  }
  std::vector<double> tilts;
  for (const GridView& view : fit.views) tilts.push_back(tilt_of(view, settings.shape));
  result.tilt_rad = third_largest(std::move(tilts));
  if (fit.covariance.size() == 0) return;
  result.sigma = fit.covariance.diagonal().cwiseSqrt();
  result.lens_sigma_px = lens_sigma_px(fit.lens, fit.covariance, result.seen_px);
}

}  // namespace

GridCalibration calibrate_grid(const std::vector<GridPicture>& pictures,
                               const GridSettings& settings) {
  GridCalibration result;
  const auto part = [&](double begin, double end) {
    return [&settings, begin, end](double share) {
      if (settings.on_progress) settings.on_progress(begin + share * (end - begin));
    };
  };
  // A guess, and a longer lens that also sees what lies beyond the guess's rim.
  const auto guess = [&](double scale) {
    return generic_grid_lens(settings.kind, settings.resolution, settings.fov_rad, scale);
  };
  Orders orders = orders_with(pictures, {guess(1.0), guess(2.0)}, settings.shape, part(0.0, 0.4));
  Views found;
  if (const auto start = first_lens(orders, settings)) {
    found = views_with(orders, *start, settings.shape);
    GridFit fit = fit_of(*start, settings.shape, found);
    // Once more with a lens that is nearly right: corners that were missed are found now.
    Orders again = orders_with(pictures, {fit.lens}, settings.shape, part(0.5, 0.9));
    if (leds_of(again) >= leds_of(orders)) orders = std::move(again);
    found = views_with(orders, fit.lens, settings.shape);
    fit = fit_of(fit.lens, settings.shape, found);
    result.views = found.pictures;
    describe(fit, settings, result);
    result.held_out_px = held_out_rms(fit, settings.shape);
    judge_grid(fit, pictures, settings, result);
  } else {
    judge_views(pictures, settings, result);
  }
  part(0.0, 1.0)(1.0);
  return result;
}

}  // namespace crepes
