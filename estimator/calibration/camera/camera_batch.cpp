#include "estimator/calibration/camera/camera_batch.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/camera/camera_refusal.hpp"
#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/calibration/camera/pixel_derivatives.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

namespace at = camera_constants;

constexpr double kHeldOutEvery_s = 5.0;  // one second of five
constexpr int kHeldOutPicture = 5;       // of a grid, which one picture shows well: one of five
constexpr double kShareOfFit = 0.8;      // of the time; the rest is cross-validation

/// 1 for sightings that enter the fit, 0 for those that are held out.
std::vector<double> fitted_mask(std::span<const BoardSighting> sightings, BoardLayout layout) {
  std::vector<double> mask;
  mask.reserve(sightings.size());
  int picture = 0;
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const double t_s = to_seconds(sightings[i].stamp - sightings.front().stamp);
    if (i > 0 && sightings[i].stamp != sightings[i - 1].stamp) ++picture;
    const bool is_held_out = layout == BoardLayout::kRigid
                                 ? picture % kHeldOutPicture == kHeldOutPicture - 1
                                 : std::fmod(t_s, kHeldOutEvery_s) >= kHeldOutEvery_s - 1.0;
    mask.push_back(is_held_out ? 0.0 : 1.0);
  }
  return mask;
}

/// RMS of a coordinate over the sightings of mask 0, outliers left out.
double held_out_rms(const CameraSolution& solution, const std::vector<double>& mask) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    if (mask[i] > 0.0 || is_outlier(solution.residuals[i], solution.sigma_px)) continue;
    sum += solution.residuals[i].uv.squaredNorm();
    count += 2.0;
  }
  return count > 0.0 ? std::sqrt(sum / count) : 0.0;
}

/// RMS over a circle of this radius of what a body direction's pixel errs by: lens and rotation.
double lens_sigma_px(const CameraConstants& constants, const Eigen::MatrixXd& covariance,
                     double circle) {
  const Eigen::Matrix<double, 9, 9> P = covariance.topLeftCorner<9, 9>();
  double sum = 0.0;
  int count = 0;
  for (const Eigen::Vector2d& uv : points_of_circle(constants.lens.tail<2>(), circle)) {
    const auto u_C = direction_of(constants.lens, uv);
    if (!u_C) continue;
    const Eigen::Vector3d u_B = constants.q_C_B.conjugate() * *u_C;
    const auto derivatives = pixel_derivatives(9, 1e-6, [&](Eigen::Index i, double step) {
      LensVector lens = constants.lens;
      Eigen::Vector3d turn = Eigen::Vector3d::Zero();
      if (i < 6) lens[i] += step;
      if (i >= 6) turn[i - 6] = step;
      return project_double_sphere<double>(lens, constants.q_C_B * (so3_exp(turn) * u_B));
    });
    if (!derivatives) continue;
    const Eigen::Matrix<double, 2, 9> J = *derivatives;
    sum += (J * P * J.transpose()).trace();
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

Eigen::Vector3d rate_rms(std::span<const ImuSample> imu, const Eigen::Vector3d& bias) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) sum += (sample.gyro_radps - bias).cwiseAbs2();
  return (sum / static_cast<double>(imu.size())).cwiseSqrt();
}

void describe(const CameraSolution& solution, const CameraBatchSettings& settings,
              std::span<const BoardSighting> sightings, CameraBatchResult& result) {
  result.constants = solution.state.constants;
  result.covariance = solution.covariance;
  const Eigen::VectorXd sigma = solution.covariance.diagonal().cwiseSqrt();
  result.lens_sigma = sigma.segment<6>(at::kLens);
  result.rotation_sigma_rad = sigma.segment<3>(at::kRotation);
  result.position_sigma_m = sigma.segment<3>(at::kPosition);
  result.shift_sigma_s = sigma(at::kShift);
  for (const CameraKnot& knot : solution.state.knots) {
    result.gyro_bias += knot.gyro_bias / static_cast<double>(solution.state.knots.size());
    result.accel_bias += knot.accel_bias / static_cast<double>(solution.state.knots.size());
  }
  result.spot_sigma_px = solution.sigma_px;
  result.outliers = solution.outliers;
  result.lens_sigma_px = lens_sigma_px(
      result.constants, solution.covariance,
      image_circle_px(sightings, result.constants.lens.tail<2>(), settings.width, settings.height));
  result.map =
      map_of(sightings, solution.residuals, solution.sigma_px, settings.width, settings.height);
}

}  // namespace

CameraBatchResult calibrate_camera(std::span<const ImuSample> imu,
                                   const std::vector<BoardSighting>& sightings,
                                   const std::vector<std::string>& names,
                                   const CameraBatchSettings& settings) {
  CameraBatchResult result;
  result.refusals = refusals_before_fit(imu, sightings);
  if (!result.refusals.empty()) return result;
  const auto aligned = align_camera(imu, sightings, settings.lens);
  if (!aligned) {
    result.refusals.emplace_back("no board is seen in successive frames");
    return result;
  }
  CameraConstants guess;
  guess.lens = settings.lens;
  guess.q_C_B = aligned->q_C_B;
  guess.p_B_C = settings.p_B_C;
  CameraProblem problem(imu, sightings, settings.noise, {});
  const CameraState start = first_state(problem, imu, names.size(), guess, aligned->gyro_bias);
  return calibrate_camera_from(start, problem, imu, names, settings);
}

CameraBatchResult calibrate_camera_from(const CameraState& start, CameraProblem& problem,
                                        std::span<const ImuSample> imu,
                                        const std::vector<std::string>& names,
                                        const CameraBatchSettings& settings) {
  CameraBatchResult result;
  const std::span<const BoardSighting> sightings = problem.sightings();
  const auto report = [&](double done) {
    if (settings.on_progress) settings.on_progress(kShareOfFit * done);
  };
  const CameraSolution solution = solve_camera(problem, start, report);
  result.rate_rms_radps = rate_rms(imu, start.knots.front().gyro_bias);
  if (solution.covariance.size() == 0) {
    result.refusals = motion_refusals(result.rate_rms_radps);
    result.refusals.emplace_back("the recording does not determine the camera");
    return result;
  }
  describe(solution, settings, sightings, result);
  result.rate_rms_radps = rate_rms(imu, result.gyro_bias);
  judge_camera(solution, sightings, names, settings, result);
  if (result.refusals.empty()) {
    const std::vector<double> mask = fitted_mask(sightings, start.constants.layout);
    result.held_out_px = held_out_rms(resolve_camera(problem, start, solution, mask), mask);
    judge_held_out(result);
  }
  report(1.0 / kShareOfFit);
  return result;
}

}  // namespace crepes
