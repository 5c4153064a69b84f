#include "estimator/calibration/camera/camera_refusal.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "estimator/calibration/number_text.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kLeastRecording_s = 20.0;
constexpr std::size_t kLeastSightings = 1000;
constexpr double kLongestGap_s = 0.1;  // of the IMU
constexpr double kLeastRate = 0.2;     // [rad/s] RMS about each axis of the body
constexpr double kMostLensSigma_px = 1.0;
constexpr double kGoodLensSigma_px = 0.3;
constexpr double kMostSpotSigma_px = 1.5;
constexpr double kMovedOutliers = 0.2;  // of one board's sightings
constexpr double kLeastQuarter = 0.02;  // of all sightings
constexpr double kRim = 0.75;           // of the image circle's radius
constexpr double kRimRatio = 2.0;
constexpr double kHeldOutRatio = 1.5;

double rms_px(double square, double count) { return std::sqrt(square / (2.0 * count)); }

/// A board's sightings that the others contradict.
void check_boards(const CameraSolution& solution, std::span<const BoardSighting> sightings,
                  const std::vector<std::string>& names, CameraBatchResult& result) {
  std::vector<double> all(names.size(), 0.0);
  std::vector<double> bad(names.size(), 0.0);
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const SightingResidual& residual = solution.residuals[i];
    all[sightings[i].board] += 1.0;
    if (is_outlier(residual, solution.sigma_px)) bad[sightings[i].board] += 1.0;
  }
  for (std::size_t b = 0; b < names.size(); ++b) {
    if (all[b] > 0.0 && bad[b] > kMovedOutliers * all[b]) {
      result.refusals.push_back(
          fmt::format("{} moved, or is seen in a mirror: {} % of its sightings contradict "
                      "the others",
                      names[b], number_text(100.0 * bad[b] / all[b], 0)));
    }
  }
}

/// The inertial samples know the meter, too.
void check_layout_scale(const CameraSolution& solution, CameraBatchResult& result) {
  constexpr double kSigmas = 4.0;
  constexpr double kLeast = 0.005;
  const CameraConstants& constants = solution.state.constants;
  if (constants.layout != BoardLayout::kRigid) return;
  const int index = camera_constants::kBoards + kRigidUnknowns - 1;
  const double sigma = std::sqrt(solution.covariance(index, index));
  const double off = std::log(constants.layout_scale);
  if (std::abs(off) < std::max(kLeast, kSigmas * sigma)) return;
  result.warnings.push_back(fmt::format(
      "the pitch of the grid is {} +- {} times what was said; the result allows for it; "
      "measure it over all rows and all columns",
      number_text(constants.layout_scale, 3), number_text(sigma, 3)));
}

void check_quarters(std::span<const BoardSighting> sightings, const CameraBatchSettings& settings,
                    CameraBatchResult& result) {
  constexpr std::array<std::string_view, 4> kQuarters{"upper left", "upper right", "lower left",
                                                      "lower right"};
  std::array<double, 4> counts{};
  for (const BoardSighting& sighting : sightings) {
    const std::size_t right = sighting.uv.x() > 0.5 * settings.width ? 1 : 0;
    const std::size_t low = sighting.uv.y() > 0.5 * settings.height ? 1 : 0;
    counts[2 * low + right] += 1.0;
  }
  for (std::size_t q = 0; q < counts.size(); ++q) {
    if (counts[q] < kLeastQuarter * static_cast<double>(sightings.size())) {
      result.warnings.push_back(
          fmt::format("nothing seen in the {} quarter of the picture: the lens is not known there",
                      kQuarters[q]));
    }
  }
}

/// A lens whose field of view is larger than its model shows in the outermost ring first.
void check_rim(const CameraSolution& solution, std::span<const BoardSighting> sightings,
               const CameraBatchSettings& settings, CameraBatchResult& result) {
  constexpr double kLeast = 50.0;
  const Eigen::Vector2d center = solution.state.constants.lens.tail<2>();
  const double circle = image_circle_px(sightings, center, settings.width, settings.height);
  std::array<double, 2> square{};
  std::array<double, 2> count{};
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    if (is_outlier(solution.residuals[i], solution.sigma_px)) continue;
    const double r = (sightings[i].uv - center).norm();
    const std::size_t ring = r > kRim * circle ? 1 : 0;
    square[ring] += solution.residuals[i].uv.squaredNorm();
    count[ring] += 1.0;
  }
  if (count[1] < kLeast) {
    result.warnings.emplace_back("nothing seen near the rim of the picture: turn further");
    return;
  }
  const double inner = rms_px(square[0], std::max(1.0, count[0]));
  const double outer = rms_px(square[1], count[1]);
  if (outer > kRimRatio * inner) {
    result.warnings.push_back(fmt::format(
        "residuals grow to the rim ({} px against {} px): the field of view is larger than said, "
        "or the lens is no Double Sphere",
        number_text(outer, 2), number_text(inner, 2)));
  }
}

}  // namespace

std::vector<std::string> refusals_before_fit(std::span<const ImuSample> imu,
                                             std::span<const BoardSighting> sightings) {
  std::vector<std::string> reasons;
  if (imu.size() < 2) return {"no inertial samples"};
  if (sightings.size() < kLeastSightings) {
    reasons.push_back(fmt::format(
        "{} sightings of identified boards, at least {} are needed: are the boards' patterns in "
        "swarm.members, and are they in view?",
        sightings.size(), kLeastSightings));
    return reasons;
  }
  const auto sampled = static_cast<std::size_t>(std::ranges::count_if(
      sightings, [&](const BoardSighting& s) { return is_sampled(s.stamp, imu); }));
  if (sampled < kLeastSightings) {
    reasons.push_back(fmt::format(
        "inertial samples at the times of {} of {} sightings only: are the stamps of both of one "
        "clock, and was the sensor there all the time?",
        sampled, sightings.size()));
    return reasons;
  }
  const double seen_s = to_seconds(std::min(sightings.back().stamp, imu.back().stamp) -
                                   std::max(sightings.front().stamp, imu.front().stamp));
  if (seen_s < kLeastRecording_s) {
    reasons.push_back(
        fmt::format("the target is seen for {} s only; record a minute", number_text(seen_s, 0)));
  }
  double gap_s = 0.0;
  for (std::size_t i = 1; i < imu.size(); ++i)
    gap_s = std::max(gap_s, to_seconds(imu[i].stamp - imu[i - 1].stamp));
  if (gap_s > kLongestGap_s)
    reasons.push_back(fmt::format("a gap of {} s in the inertial samples", number_text(gap_s, 2)));
  return reasons;
}

std::vector<std::string> motion_refusals(const Eigen::Vector3d& rate_rms_radps) {
  constexpr std::array<std::string_view, 3> kAxes{"x (roll)", "y (pitch)", "z (yaw)"};
  std::vector<std::string> reasons;
  for (int i = 0; i < 3; ++i) {
    if (rate_rms_radps[i] < kLeastRate) {
      reasons.push_back(fmt::format(
          "hardly turned about {}: {} deg/s RMS, at least {} are needed about each axis of the "
          "body",
          kAxes[static_cast<std::size_t>(i)], number_text(rate_rms_radps[i] * kDegPerRad, 1),
          number_text(kLeastRate * kDegPerRad, 0)));
    }
  }
  return reasons;
}

void judge_camera(const CameraSolution& solution, std::span<const BoardSighting> sightings,
                  const std::vector<std::string>& names, const CameraBatchSettings& settings,
                  CameraBatchResult& result) {
  result.refusals = motion_refusals(result.rate_rms_radps);
  check_boards(solution, sightings, names, result);
  if (solution.sigma_px > kMostSpotSigma_px) {
    result.refusals.push_back(fmt::format(
        "residuals of {} px: boards moved, the time stamps jitter, or the picture is blurred",
        number_text(solution.sigma_px, 2)));
  }
  if (result.lens_sigma_px > kMostLensSigma_px) {
    result.refusals.push_back(fmt::format(
        "the lens remains uncertain by {} px (one sigma, RMS over the picture); turn more, about "
        "all axes, so that a board crosses every part of the picture",
        number_text(result.lens_sigma_px, 2)));
  }
  if (!solution.has_converged)
    result.warnings.emplace_back("the solver had not converged when it stopped");
  if (result.lens_sigma_px > kGoodLensSigma_px) {
    result.warnings.push_back(fmt::format(
        "the lens is known to {} px only: a second board and faster turns make it better",
        number_text(result.lens_sigma_px, 2)));
  }
  check_layout_scale(solution, result);
  check_quarters(sightings, settings, result);
  check_rim(solution, sightings, settings, result);
}

void judge_held_out(CameraBatchResult& result) {
  if (result.held_out_px > kHeldOutRatio * result.spot_sigma_px) {
    result.warnings.push_back(
        fmt::format("what was held out of the fit fits worse ({} px) than the rest ({} px)",
                    number_text(result.held_out_px, 2), number_text(result.spot_sigma_px, 2)));
  }
}

}  // namespace crepes
