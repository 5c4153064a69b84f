#include "estimator/core/signal_model.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "tests/support/random_geometry.hpp"

namespace crepes::signal_model_test {
namespace {

using test::RandomGeometry;

constexpr double kPeriod = 0.01;  // s
constexpr int kStride = SignalModel::kStride;

/// `newest` and those before it.
template <class Samples = SignalModel::Past>
Samples window_at(const std::vector<Eigen::Vector3d>& samples, std::size_t newest) {
  Samples window;
  for (int back = 0; back < window.cols(); ++back)
    window.col(back) = samples.at(newest - static_cast<std::size_t>(back));
  return window;
}

struct Missed {
  double predicted = 0.0;  ///< RMS
  double held = 0.0;
  double innovation_density = 0.0;  ///< of the model at the end
};

/// How far a model that learns along the way is from what comes so many strides later.
Missed missed_by(const std::vector<Eigen::Vector3d>& samples, int strides = 1) {
  SignalModel model;
  Missed sum;
  int n = 0;
  const auto ahead = static_cast<std::size_t>(strides) * kStride;
  for (std::size_t i = SignalModel::Past::ColsAtCompileTime; i + ahead < samples.size(); ++i) {
    model.observe(window_at(samples, i), kPeriod);
    if (i < samples.size() / 2) continue;
    const auto window = window_at<SignalModel::Window>(samples, i);
    const Eigen::Vector3d change = samples.at(i + ahead) - samples.at(i);
    sum.predicted += (model.change_after(strides, window) - change).squaredNorm() / 3.0;
    sum.held += change.squaredNorm() / 3.0;
    ++n;
  }
  return {std::sqrt(sum.predicted / n), std::sqrt(sum.held / n), model.innovation_density(strides)};
}

/// Twenty seconds of a hand's swing.
std::vector<Eigen::Vector3d> swing(double noise) {
  RandomGeometry random(4);
  std::vector<Eigen::Vector3d> samples;
  for (int i = 0; i < 2000; ++i) {
    const double t = kPeriod * i;
    samples.emplace_back(Eigen::Vector3d(2.0 * std::sin(6.0 * t), std::cos(4.0 * t + 1.0), 0.5) +
                         random.normal_vector<3>(noise));
  }
  return samples;
}

TEST(SignalModel, KnowsHowASwingGoesOn) {
  for (const double noise : {0.0, 0.005, 0.05}) {
    const std::vector<Eigen::Vector3d> samples = swing(noise);

    const Missed missed = missed_by(samples);

    EXPECT_LT(missed.predicted, 0.1 * missed.held + 2.5 * noise);
    EXPECT_NEAR(missed.innovation_density / (missed.predicted / std::sqrt(kStride * kPeriod)), 1.0,
                0.4);
  }
}

TEST(SignalModel, KnowsHowASwingGoesOnWhileSamplesAreMissing) {
  constexpr double kNoise = 0.005;
  const std::vector<Eigen::Vector3d> samples = swing(kNoise);

  for (const int strides : {2, 3, 5, 7}) {
    const Missed missed = missed_by(samples, strides);

    EXPECT_LT(missed.predicted, (strides > 5 ? 0.15 : 0.1) * missed.held) << strides;
    EXPECT_NEAR(
        missed.innovation_density / (missed.predicted / std::sqrt(strides * kStride * kPeriod)),
        1.0, 0.4)
        << strides;
  }
}

TEST(SignalModel, AveragesNoiseInsteadOfFollowingIt) {
  RandomGeometry random(5);
  std::vector<Eigen::Vector3d> samples;
  for (int i = 0; i < 4000; ++i) samples.push_back(random.normal_vector<3>(0.2));

  const Missed missed = missed_by(samples);

  // The mean of three is off by sqrt(1 + 1/3) of a sample's noise, one sample by sqrt(2).
  EXPECT_NEAR(missed.held / 0.2, std::sqrt(2.0), 0.05);
  EXPECT_NEAR(missed.predicted / 0.2, std::sqrt(4.0 / 3.0), 0.06);
}

TEST(SignalModel, ReadsNoiseOffASwing) {
  RandomGeometry random(6);
  std::vector<Eigen::Vector3d> samples;
  for (int i = 0; i < 1000; ++i) {
    samples.emplace_back(Eigen::Vector3d::Constant(2.0 * std::sin(0.05 * i)) +
                         random.normal_vector<3>(0.1));
  }
  SignalModel model;
  constexpr std::size_t kFirst = SignalModel::Past::ColsAtCompileTime;
  for (std::size_t i = kFirst; i < samples.size(); ++i)
    model.observe(window_at(samples, i), kPeriod);

  EXPECT_NEAR(model.noise_density() / (0.1 * std::sqrt(kPeriod)), 1.0, 0.3);
}

// A rover that drives smoothly hits something, and its suspension rings.
TEST(SignalModel, DoesNotExplainAShockByTheNoiseBeforeIt) {
  constexpr int kQuiet = 200;
  constexpr int kRinging = 50;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    RandomGeometry random(500 + seed);
    const Eigen::Vector3d amplitude = random.vector(1.0);
    const double omega = 2.0 * std::numbers::pi * random.uniform(6.0, 14.0);
    SignalModel model;
    std::vector<Eigen::Vector3d> samples;
    double largest = 0.0;
    for (int i = 0; i < kQuiet + kRinging; ++i) {
      const double t = kPeriod * std::max(0, i - kQuiet);
      const double ringing = std::exp(-12.0 * t) * std::sin(omega * t);
      samples.emplace_back(ringing * amplitude + random.vector(0.01));
      if (i < SignalModel::Past::ColsAtCompileTime) continue;
      const auto newest = static_cast<std::size_t>(i);
      model.observe(window_at(samples, newest), kPeriod);
      if (i > kQuiet) largest = std::max(largest, samples.back().norm());
      const auto window = window_at<SignalModel::Window>(samples, newest);
      for (int strides = 1; strides <= SignalModel::kHorizons && i > kQuiet; ++strides) {
        const Eigen::Vector3d predicted = samples.back() + model.change_after(strides, window);
        ASSERT_LT(predicted.norm(), 2.0 * largest + 0.1) << seed << ", " << i << ", " << strides;
      }
    }
  }
}

TEST(SignalModel, StaysWithinReasonWhateverItSees) {
  for (int seed = 0; seed < 100; ++seed) {
    RandomGeometry random(100 + seed);
    SignalModel model;
    std::vector<Eigen::Vector3d> samples;
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 300; ++i) {
      // Stands still, jumps to the end of the range and back, drifts by the least there is.
      if (random.index(10) == 0) value = random.vector(random.index(2) == 0 ? 100.0 : 1e-300);
      samples.push_back(value);
      if (i < SignalModel::Past::ColsAtCompileTime) continue;
      model.observe(window_at(samples, i), kPeriod);
      const auto window = window_at<SignalModel::Window>(samples, i);
      ASSERT_TRUE(model.change_after(7.0, window).allFinite());
      ASSERT_TRUE(std::isfinite(model.innovation_density(2.5)) &&
                  std::isfinite(model.noise_density()));
      const double range = window.colwise().norm().maxCoeff();
      ASSERT_LE(model.change_after(1.0, window).norm(), 4.0 * range)
          << "of a jump by twice the range";
    }
  }
}

}  // namespace
}  // namespace crepes::signal_model_test
