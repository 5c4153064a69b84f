#include "estimator/calibration/imu/imu_calibration.hpp"

#include <ceres/autodiff_cost_function.h>
#include <ceres/covariance.h>
#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>
#include <ceres/solver.h>
#include <fmt/core.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "estimator/calibration/imu/imu_refusal.hpp"
#include "estimator/calibration/imu/wandering_bias.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr int kAccelParameters = 9;  // M's upper triangle by rows, then the bias
constexpr int kGyroParameters = 9;   // M by rows

// A new object whose ownership passes to Ceres with the pointer.
template <class T, class... Arguments>
T* owned_by_ceres(Arguments&&... arguments) {
  return std::make_unique<T>(std::forward<Arguments>(arguments)...).release();
}

/// (|M (a - b)| - g) / sigma
struct GravityFactor {
  Eigen::Vector3d accel;
  double gravity;
  double sigma;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    const T a = accel.x() - x[6];
    const T b = accel.y() - x[7];
    const T c = accel.z() - x[8];
    const T f_x = x[0] * a + x[1] * b + x[2] * c;
    const T f_y = x[3] * b + x[4] * c;
    const T f_z = x[5] * c;
    residual[0] = (sqrt(f_x * f_x + f_y * f_y + f_z * f_z) - gravity) / sigma;
    return true;
  }
};

struct RateStep {
  Eigen::Vector3d rate;  ///< as read, less the bias [rad/s]
  double dt_s = 0.0;
};

/// The direction of gravity, carried through a turn, against that of the next rest. A sample is the
/// mean of its interval:  phi_i = d_i + d_{i-1} x d_i / 12,  d_i = M (w_i - b) dt  (Savage 1998,
/// eq. 43: coning over two intervals).
struct TurnFactor {
  std::vector<RateStep> steps;
  Eigen::Vector3d up_before = Eigen::Vector3d::UnitZ();
  /// The direction after the turn, its two tangents.
  Eigen::Matrix<double, 3, 2> across = Eigen::Matrix<double, 3, 2>::Zero();
  double sigma = 1.0;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    constexpr double kConing = 1.0 / 12.0;
    const Eigen::Map<const Eigen::Matrix<T, 3, 3, Eigen::RowMajor>> M(x);
    Vector u = up_before.cast<T>();
    Vector before = Vector::Zero();
    for (const RateStep& step : steps) {
      const Vector d = M * (step.dt_s * step.rate).cast<T>();
      const Vector back = -(d + T(kConing) * before.cross(d));
      Vector turned;
      ceres::AngleAxisRotatePoint(back.data(), u.data(), turned.data());
      u = turned;
      before = d;
    }
    Eigen::Map<Eigen::Matrix<T, 2, 1>> weighed(residual);
    weighed = across.cast<T>().transpose() * u / T(sigma);
    return true;
  }
};

struct Fit {
  double chi2 = 0.0;
  int residuals = 0;
  std::vector<double> sigmas;  ///< empty if the parameters are not determined
};

/// Solves, and returns sigmas that are enlarged where the residuals are larger than expected.
template <std::size_t N>
Fit solve(ceres::Problem& problem, std::array<double, N>& x) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-14;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  Fit fit{.chi2 = 2.0 * summary.final_cost, .residuals = problem.NumResiduals(), .sigmas = {}};
  if (!summary.IsSolutionUsable()) return fit;

  ceres::Covariance::Options exact;
  exact.algorithm_type = ceres::DENSE_SVD;
  exact.num_threads = 1;
  ceres::Covariance covariance(exact);
  Eigen::Matrix<double, N, N, Eigen::RowMajor> P;
  const std::vector<std::pair<const double*, const double*>> blocks{{x.data(), x.data()}};
  if (fit.residuals <= static_cast<int>(N) || !covariance.Compute(blocks, &problem) ||
      !covariance.GetCovarianceBlock(x.data(), x.data(), P.data()))
    return fit;
  const double inflation =
      std::max(1.0, fit.chi2 / static_cast<double>(fit.residuals - static_cast<int>(N)));
  for (std::size_t i = 0; i < N; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    fit.sigmas.push_back(std::sqrt(inflation * P(k, k)));
  }
  return fit;
}

/// One sigma of a rest's mean specific force: white noise, and the bias's wandering from its mean.
double rest_sigma(const Rest& rest, double density, double random_walk, double recording_s) {
  constexpr double kShareOfWalk = 1.0 / 6.0;  // variance of a walk about its mean, over time
  return std::sqrt(density * density / rest.duration_s() +
                   random_walk * random_walk * recording_s * kShareOfWalk);
}

void fit_accelerometer(const ImuCalibrationSettings& settings, ImuCalibration& found) {
  std::array<double, kAccelParameters> x{1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0};
  using Cost = ceres::AutoDiffCostFunction<GravityFactor, 1, kAccelParameters>;
  ceres::Problem problem;
  const double recording_s = found.search.rests.back().end_s;
  for (const Rest& rest : found.search.rests) {
    const double sigma = rest_sigma(rest, found.accel_noise_density,
                                    settings.noise.accelerometer_random_walk, recording_s);
    problem.AddResidualBlock(owned_by_ceres<Cost>(owned_by_ceres<GravityFactor>(
                                 GravityFactor{rest.accel_mps2, settings.gravity_mps2, sigma})),
                             owned_by_ceres<ceres::HuberLoss>(3.0), x.data());
  }
  const Fit fit = solve(problem, x);

  TriadEstimate& triad = found.accelerometer;
  triad.M << x[0], x[1], x[2], 0.0, x[3], x[4], 0.0, 0.0, x[5];
  triad.bias = {x[6], x[7], x[8]};
  double sum = 0.0;
  for (const Rest& rest : found.search.rests)
    sum += std::pow((triad.M * (rest.accel_mps2 - triad.bias)).norm() - settings.gravity_mps2, 2);
  triad.residual_rms = std::sqrt(sum / static_cast<double>(found.search.rests.size()));
  if (fit.sigmas.empty()) {
    found.refusals.emplace_back("the attitudes do not determine the accelerometer's errors");
    return;
  }
  const std::vector<double>& s = fit.sigmas;
  triad.M_sigma << s[0], s[1], s[2], 0.0, s[3], s[4], 0.0, 0.0, s[5];
  triad.bias_sigma = {s[6], s[7], s[8]};
}

/// Whether samples are missing between two rests: how far the body turned there is unknown.
bool has_gap(std::span<const ImuSample> samples, const Rest& from, const Rest& to) {
  constexpr double kLongestGap_s = 0.05;
  constexpr double kPeriods = 2.5;
  const double period_s = to_seconds(samples.back().stamp - samples.front().stamp) /
                          static_cast<double>(samples.size() - 1);
  const double longest_s = std::max(kLongestGap_s, kPeriods * period_s);
  for (std::size_t i = from.last; i <= to.first; ++i)
    if (to_seconds(samples[i].stamp - samples[i - 1].stamp) > longest_s) return true;
  return false;
}

Eigen::Vector3d up_at(const Rest& rest, const TriadEstimate& accelerometer) {
  return (accelerometer.M * (rest.accel_mps2 - accelerometer.bias)).normalized();
}

TurnFactor turn_between(std::span<const ImuSample> samples, const Rest& from, const Rest& to,
                        const Eigen::Vector3d& bias, const ImuCalibration& found,
                        double gravity_mps2) {
  TurnFactor turn;
  for (std::size_t i = from.last; i < to.first; ++i) {
    turn.steps.push_back(
        {samples[i].gyro_radps - bias, to_seconds(samples[i].stamp - samples[i - 1].stamp)});
  }
  turn.up_before = up_at(from, found.accelerometer);
  turn.across = tangent_basis(up_at(to, found.accelerometer));
  const double turn_s = to.begin_s - from.end_s;
  const double gyro = found.gyro_noise_density;
  const double accel = found.accel_noise_density / gravity_mps2;
  turn.sigma = std::sqrt(gyro * gyro * turn_s * (1.0 + turn_s / from.duration_s() / 2.0) +
                         accel * accel * (1.0 / from.duration_s() + 1.0 / to.duration_s()));
  return turn;
}

void fit_gyroscope(std::span<const ImuSample> samples, const ImuCalibrationSettings& settings,
                   ImuCalibration& found) {
  const std::vector<Rest>& rests = found.search.rests;
  const WanderingBias bias(rests, found.gyro_noise_density, settings.noise.gyroscope_random_walk);
  std::array<double, kGyroParameters> x{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  using Cost = ceres::AutoDiffCostFunction<TurnFactor, 2, kGyroParameters>;
  ceres::Problem problem;
  double weighted_sigma2 = 0.0;
  std::size_t missing = 0;
  for (std::size_t k = 0; k + 1 < rests.size(); ++k) {
    if (has_gap(samples, rests[k], rests[k + 1])) {
      ++missing;
      continue;
    }
    TurnFactor turn = turn_between(samples, rests[k], rests[k + 1], bias.between(k), found,
                                   settings.gravity_mps2);
    weighted_sigma2 += turn.sigma * turn.sigma;
    problem.AddResidualBlock(owned_by_ceres<Cost>(owned_by_ceres<TurnFactor>(std::move(turn))),
                             owned_by_ceres<ceres::HuberLoss>(3.0), x.data());
  }
  if (missing > 0) {
    found.warnings.push_back(fmt::format(
        "samples are missing in {} of {} turns, which do not count", missing, rests.size() - 1));
  }
  const Fit fit = solve(problem, x);

  TriadEstimate& triad = found.gyroscope;
  triad.M = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(x.data());
  triad.bias = bias.mean();
  triad.bias_sigma.setConstant(bias.mean_sigma());
  if (fit.sigmas.empty()) {
    found.refusals.emplace_back("the turns do not determine the gyroscope's errors");
    return;
  }
  triad.residual_rms = std::sqrt(fit.chi2 / fit.residuals * weighted_sigma2 /
                                 static_cast<double>(rests.size() - 1 - missing));
  triad.M_sigma = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(fit.sigmas.data());
}

}  // namespace

ImuCalibration calibrate_imu(std::span<const ImuSample> samples,
                             const ImuCalibrationSettings& settings) {
  ImuCalibration found;
  found.search = find_rests(samples);
  found.attitudes = count_attitudes(found.search.rests);
  const double duration_s =
      samples.empty() ? 0.0 : to_seconds(samples.back().stamp - samples.front().stamp);
  const double root_period_s =
      std::sqrt(duration_s / std::max(1.0, static_cast<double>(samples.size()) - 1.0));
  found.gyro_noise_density = found.search.gyro_sigma_radps * root_period_s;
  found.accel_noise_density = found.search.accel_sigma_mps2 * root_period_s;

  found.refusals = refusals_before_fit(found);
  if (!found.refusals.empty()) return found;
  fit_accelerometer(settings, found);
  if (found.refusals.empty()) fit_gyroscope(samples, settings, found);
  judge_fit(settings, found);
  return found;
}

}  // namespace crepes
