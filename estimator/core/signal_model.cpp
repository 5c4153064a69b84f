#include "estimator/core/signal_model.hpp"

#include <Eigen/LU>
#include <cmath>

namespace crepes {
namespace {

constexpr double kNoiseShare = 0.02;       // of one sample in the smoothed noise: 0.5 s at 100 Hz
constexpr double kPredictionShare = 0.01;  // ... in the prediction's weights: 1 s
constexpr double kRidge = 1e-3;            // of the changes' power, in both
constexpr double kMostGrowth = 2.0;        // from one change to the next

// The last two changes before sample `now` of a window, as columns, the later one first.
Eigen::Matrix<double, 3, 2> changes_before(const SignalModel::Window& window, int now) {
  const auto sample = [&](int strides) { return window.col(now + strides * SignalModel::kStride); };
  Eigen::Matrix<double, 3, 2> changes;
  changes << sample(0) - sample(1), sample(1) - sample(2);
  return changes;
}

}  // namespace

void SignalModel::observe(const Window& window, double period_s) {
  const auto smooth = [](double value, double& mean) { mean += kNoiseShare * (value - mean); };
  // White noise of variance s^2 has second differences of variance 6 s^2, on each of three axes.
  const Eigen::Vector3d second = window.col(0) - 2.0 * window.col(1) + window.col(2);
  smooth(period_s * second.squaredNorm() / 18.0, noise_density2_);

  const Eigen::Matrix<double, 3, 2> before = changes_before(window, kStride);
  const Eigen::Vector3d next = window.col(0) - window.col(kStride);
  const double span_s = kStride * period_s;
  smooth((next - before * weights_).squaredNorm() / 3.0 / span_s, innovation_density2_);

  changes_ += kPredictionShare * (before.transpose() * before - changes_);
  with_next_ += kPredictionShare * (before.transpose() * next - with_next_);
  const double power = changes_.trace();
  if (!(power > 0.0)) return;
  const Eigen::Matrix2d ridged = changes_ + kRidge * power * Eigen::Matrix2d::Identity();
  weights_ = ridged.inverse() * with_next_;
}

Eigen::Vector3d SignalModel::next_change(const Window& window) const {
  const Eigen::Matrix<double, 3, 2> before = changes_before(window, 0);
  const Eigen::Vector3d next = before * weights_;
  const double most = kMostGrowth * before.colwise().norm().maxCoeff();
  const double size = next.norm();
  return size > most ? Eigen::Vector3d(most / size * next) : next;
}

double SignalModel::noise_density() const { return std::sqrt(noise_density2_); }

double SignalModel::innovation_density() const { return std::sqrt(innovation_density2_); }

}  // namespace crepes
