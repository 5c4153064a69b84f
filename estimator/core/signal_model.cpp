#include "estimator/core/signal_model.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace crepes {
namespace {

constexpr double kNoiseShare = 0.02;       // of one sample in the smoothed noise: 0.5 s at 100 Hz
constexpr double kPredictionShare = 0.01;  // ... in the prediction's weights: 1 s
constexpr double kRidge = 1e-3;            // of the changes' power, in both
constexpr double kMostGrowth = 2.0;        // from one change to the next
constexpr double kBeyond = 0.5;            // of its range, for the signal beyond it

using Changes = Eigen::Matrix<double, 3, SignalModel::kChanges>;

// The last changes before sample `now`, as columns, the latest one first.
template <class Samples>
Changes changes_before(const Samples& samples, int now) {
  Changes changes;
  for (int i = 0; i < SignalModel::kChanges; ++i) {
    const int later = now + i * SignalModel::kStride;
    changes.col(i) = samples.col(later) - samples.col(later + SignalModel::kStride);
  }
  return changes;
}

// Between the values at whole strides; `value_at(0)` is before the first.
template <class ValueAt>
auto interpolated(double strides, ValueAt value_at) {
  const double inside = std::clamp(strides, 0.0, double{SignalModel::kHorizons});
  const int below = std::min(static_cast<int>(inside), SignalModel::kHorizons - 1);
  const double part = inside - below;
  return ((1 - part) * value_at(below) + part * value_at(below + 1)).eval();
}

}  // namespace

// White noise of variance s^2 has second differences of variance 6 s^2, on each of three axes.
double SignalModel::newest_noise_density2(const Past& past, double period_s) {
  const Eigen::Vector3d second = past.col(0) - 2.0 * past.col(1) + past.col(2);
  return period_s * second.squaredNorm() / 18.0;
}

void SignalModel::observe(const Past& past, double period_s) {
  const auto smooth = [](double value, double& mean) { mean += kNoiseShare * (value - mean); };
  smooth(newest_noise_density2(past, period_s), noise_density2_);
  const Eigen::Vector3d newest = past.col(0);
  low_ = newest.cwiseMin(low_ + kPredictionShare * (newest - low_));
  high_ = newest.cwiseMax(high_ + kPredictionShare * (newest - high_));

  for (int i = 0; i < kHorizons; ++i) {
    Horizon& horizon = horizons_.at(static_cast<std::size_t>(i));
    const int then = (i + 1) * kStride;
    const Changes before = changes_before(past, then);
    const Eigen::Vector3d next = past.col(0) - past.col(then);
    const double span_s = then * period_s;
    smooth((next - before * horizon.weights).squaredNorm() / 3.0 / span_s,
           horizon.innovation_density2);
    if (i + 1 == kHorizons) smooth(next.squaredNorm() / 3.0 / span_s, hold_density2_);

    horizon.changes += kPredictionShare * (before.transpose() * before - horizon.changes);
    horizon.with_next += kPredictionShare * (before.transpose() * next - horizon.with_next);
    const double power = horizon.changes.trace();
    if (!(power > 0.0)) continue;
    const Eigen::Matrix<double, kChanges, kChanges> ridged =
        horizon.changes + kRidge * power * Eigen::Matrix<double, kChanges, kChanges>::Identity();
    horizon.weights = ridged.inverse() * horizon.with_next;
  }
}

Eigen::Vector3d SignalModel::change_after(double strides, const Window& window) const {
  const Weights weights = interpolated(strides, [&](int i) -> Weights {
    return i == 0 ? Weights::Zero() : horizons_.at(static_cast<std::size_t>(i - 1)).weights;
  });
  const Changes before = changes_before(window, 0);
  const Eigen::Vector3d change = before * weights;
  const double most = kMostGrowth * std::max(1.0, strides) * before.colwise().norm().maxCoeff();
  const double size = change.norm();
  const Eigen::Vector3d bounded = size > most ? Eigen::Vector3d(most / size * change) : change;
  // After a gap the newest sample may be outside the range that was learned before it.
  const Eigen::Vector3d newest = window.col(0);
  const Eigen::Vector3d low = low_.cwiseMin(newest);
  const Eigen::Vector3d high = high_.cwiseMax(newest);
  const Eigen::Vector3d beyond = kBeyond * (high - low);
  return bounded.cwiseMin(high + beyond - newest).cwiseMax(low - beyond - newest);
}

double SignalModel::noise_density() const { return std::sqrt(noise_density2_); }

double SignalModel::innovation_density(double strides) const {
  using Scalar = Eigen::Matrix<double, 1, 1>;
  const auto density2 = interpolated(strides, [&](int i) -> Scalar {
    const auto known = static_cast<std::size_t>(std::max(i - 1, 0));
    return Scalar(horizons_.at(known).innovation_density2);
  });
  const double held = std::max(0.0, strides - kHorizons);
  return std::sqrt((kHorizons * density2(0) + held * hold_density2_) / (kHorizons + held));
}

double SignalModel::hold_density() const { return std::sqrt(hold_density2_); }

}  // namespace crepes
