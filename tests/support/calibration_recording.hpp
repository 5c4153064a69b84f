/// Simulated recordings for calibration: an IMU laid down in many attitudes, and a robot turned by
/// hand before boards. Written apart from what calibrates: paths are sums of sines, and a sample is
/// the mean of the true signal by quadrature.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <vector>

#include "estimator/calibration/camera/camera_problem.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/sensor_noise.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/vision/double_sphere.hpp"

namespace crepes::simulated {

/// Reproducible noise.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  [[nodiscard]] double normal(double sigma) { return sigma * normal_(engine_); }
  [[nodiscard]] double uniform(double from, double to) {
    return from + (to - from) * uniform_(engine_);
  }
  [[nodiscard]] Eigen::Vector3d vector(double sigma) {
    return {normal(sigma), normal(sigma), normal(sigma)};
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

/// A body's path: attitude and position in a world whose z is up.
struct Path {
  std::function<Eigen::Quaterniond(double)> q_W_B;
  std::function<Eigen::Vector3d(double)> p_W;
};

/// measured = S true + bias
struct ImuErrors {
  Eigen::Matrix3d S_gyro = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d S_accel = Eigen::Matrix3d::Identity();  ///< upper triangular
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
};

inline ImuErrors draw_errors(Dice& dice, double matrix, double gyro_bias, double accel_bias) {
  ImuErrors errors;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) errors.S_gyro(i, j) += dice.normal(matrix);
    for (int j = i; j < 3; ++j) errors.S_accel(i, j) += dice.normal(matrix);
  }
  errors.gyro_bias = dice.vector(gyro_bias);
  errors.accel_bias = dice.vector(accel_bias);
  return errors;
}

/// 100 Hz means over the interval that ends at the stamp. Biases walk. Returns the samples, and
/// `errors` with the mean biases.
inline std::vector<ImuSample> imu_along(const Path& path, double duration_s, const ImuNoise& noise,
                                        ImuErrors& errors, Dice& dice) {
  constexpr double kPeriod = 0.01;
  constexpr double h = 1e-4;
  constexpr std::array<double, 5> kWeights{7.0 / 90, 32.0 / 90, 12.0 / 90, 32.0 / 90, 7.0 / 90};
  std::vector<ImuSample> samples;
  Eigen::Vector3d gyro_bias = errors.gyro_bias;
  Eigen::Vector3d accel_bias = errors.accel_bias;
  ImuErrors mean = errors;
  mean.gyro_bias.setZero();
  mean.accel_bias.setZero();
  const double white = 1.0 / std::sqrt(kPeriod);
  const double walk = std::sqrt(kPeriod);
  const auto count = static_cast<int>(duration_s / kPeriod);
  for (int i = 0; i < count; ++i) {
    ImuSample sample{.stamp = Timestamp{from_seconds(kPeriod * (i + 1))}};
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < kWeights.size(); ++k) {
      const double t = kPeriod * (i + 0.25 * static_cast<double>(k));
      const Eigen::Quaterniond q = path.q_W_B(t);
      rate += kWeights[k] * so3_log(path.q_W_B(t - h).conjugate() * path.q_W_B(t + h)) / (2.0 * h);
      constexpr double H = 1e-3;
      const Eigen::Vector3d a = (path.p_W(t + H) - 2.0 * path.p_W(t) + path.p_W(t - H)) / (H * H);
      force += kWeights[k] * (q.conjugate() * (a + kNominalGravityMps2 * Eigen::Vector3d::UnitZ()));
    }
    sample.gyro_radps =
        errors.S_gyro * rate + gyro_bias + dice.vector(noise.gyroscope_noise_density * white);
    sample.accel_mps2 = errors.S_accel * force + accel_bias +
                        dice.vector(noise.accelerometer_noise_density * white);
    gyro_bias += dice.vector(noise.gyroscope_random_walk * walk);
    accel_bias += dice.vector(noise.accelerometer_random_walk * walk);
    mean.gyro_bias += gyro_bias / count;
    mean.accel_bias += accel_bias / count;
    samples.push_back(sample);
  }
  errors = mean;
  return samples;
}

struct Protocol {
  int attitudes = 45;
  double first_rest_s = 30.0;
  double rest_s = 3.0;
  double shake_rad = 0.0;  ///< amplitude of a hand's trembling at 6 Hz while it holds still
};

/// imu_tk's protocol: a rest, then attitudes all around, turned by hand in between.
struct ImuRecording {
  std::vector<ImuSample> samples;
  ImuErrors errors;
};
inline ImuRecording imu_protocol(std::uint64_t seed, const Protocol& protocol,
                                 const ImuNoise& noise) {
  Dice dice(seed);
  struct Turn {
    double begin_s;
    double end_s;
    Eigen::Quaterniond from;
    Eigen::Vector3d first;  ///< rotation vectors that overlap, so that axes move
    Eigen::Vector3d second;
  };
  std::vector<Turn> turns;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  double t = protocol.first_rest_s;
  for (int k = 1; k < protocol.attitudes; ++k) {
    const Turn turn{t, t + dice.uniform(1.0, 2.0), q,
                    dice.vector(1.0).normalized() * dice.uniform(1.0, 2.0),
                    dice.vector(1.0).normalized() * dice.uniform(0.5, 1.5)};
    q = (turn.from * so3_exp(turn.first) * so3_exp(turn.second)).normalized();
    turns.push_back(turn);
    t = turn.end_s + protocol.rest_s;
  }
  const auto smooth = [](double x) {
    const double c = std::clamp(x, 0.0, 1.0);
    return c * c * c * (10.0 - 15.0 * c + 6.0 * c * c);
  };
  Path path;
  path.q_W_B = [&](double time) {
    Eigen::Quaterniond at = Eigen::Quaterniond::Identity();
    const auto next = std::ranges::upper_bound(turns, time, {}, &Turn::begin_s);
    if (next != turns.begin()) {
      const Turn& turn = *(next - 1);
      const double x = (time - turn.begin_s) / (turn.end_s - turn.begin_s);
      at = turn.from * so3_exp(smooth(x / 0.8) * turn.first) *
           so3_exp(smooth((x - 0.2) / 0.8) * turn.second);
    }
    if (protocol.shake_rad > 0.0 && time > protocol.first_rest_s)
      at = at *
           so3_exp(protocol.shake_rad * std::sin(37.7 * time) * Eigen::Vector3d(1.0, 0.6, -0.4));
    return at.normalized();
  };
  path.p_W = [](double) { return Eigen::Vector3d::Zero().eval(); };
  ImuRecording recording;
  recording.errors = draw_errors(dice, 0.01, 0.01, 0.2);
  recording.samples = imu_along(path, t, noise, recording.errors, dice);
  return recording;
}

struct HandHeld {
  double duration_s = 60.0;
  double camera_rate_hz = 200.0;
  int boards = 2;
  bool is_chair = false;  ///< turned about the vertical alone
  double noise_px = 0.16;
  double dark_share = 0.25;                 ///< of the sightings
  double moved_m = 0.0;                     ///< how far the first board is moved at half time
  bool hides_quarter = false;               ///< nothing falls on the lower left quarter
  std::optional<CameraConstants> camera{};  ///< without boards; empty: drawn
  std::vector<Eigen::Vector3d> places{};    ///< of boards in the world; empty: drawn
};

/// A robot before boards: what a calibration is given, and the truth.
struct CameraRecording {
  std::vector<ImuSample> imu;
  std::vector<BoardSighting> sightings;
  CameraConstants truth;
  ImuErrors errors;
};

/// Sums of sines, growing over the first half so that light falls everywhere.
inline Path hand_path(Dice& dice, const HandHeld& hand) {
  struct Wave {
    double amplitude;
    double w;
    double phase;
  };
  const auto waves = [&dice](double amplitude, double hz) {
    std::array<Wave, 3> set{};
    for (std::size_t i = 0; i < set.size(); ++i) {
      const double scale = 1.0 / (1.0 + static_cast<double>(i));
      set[i] = {amplitude * scale * dice.uniform(0.7, 1.1),
                2.0 * std::numbers::pi * hz * dice.uniform(0.7, 1.3) / scale,
                dice.uniform(0.0, 2.0 * std::numbers::pi)};
    }
    return set;
  };
  const double across = hand.is_chair ? 0.02 : 1.0;
  const auto yaw = waves(0.75, 0.2);
  const auto pitch = waves(0.7 * across, 0.23);
  const auto roll = waves(0.6 * across, 0.17);
  const std::array place{waves(0.1, 0.3), waves(0.12, 0.25), waves(0.08, 0.35)};
  const std::array tremble{waves(3e-4, 6.0), waves(3e-4, 7.0), waves(3e-4, 6.5)};
  const auto sum = [](const std::array<Wave, 3>& set, double t) {
    double x = 0.0;
    for (const Wave& wave : set) x += wave.amplitude * std::sin(wave.w * t + wave.phase);
    return x;
  };
  const double half_s = 0.5 * hand.duration_s;
  Path path;
  path.q_W_B = [=](double t) {
    const double growth = std::min(1.0, 0.3 + 0.7 * t / half_s);
    return Eigen::Quaterniond(Eigen::AngleAxisd(growth * sum(yaw, t), Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(growth * sum(pitch, t), Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(growth * sum(roll, t), Eigen::Vector3d::UnitX()));
  };
  path.p_W = [=](double t) {
    Eigen::Vector3d p;
    for (std::size_t i = 0; i < 3; ++i)
      p[static_cast<Eigen::Index>(i)] = sum(place[i], t) + sum(tremble[i], t);
    return p;
  };
  return path;
}

inline CameraRecording hand_held(std::uint64_t seed, const HandHeld& hand, const ImuNoise& noise) {
  constexpr double kHalfFov = 1.61;
  constexpr double kWidth = 1280.0;
  constexpr double kHeight = 1024.0;
  Dice dice(seed);
  CameraRecording recording;
  CameraConstants& truth = recording.truth;
  truth.lens << -0.2 + dice.normal(0.03), 0.6 + dice.normal(0.005), 320.0 + dice.normal(6.0), 320.0,
      639.5 + dice.normal(8.0), 511.5 + dice.normal(8.0);
  truth.lens[3] = truth.lens[2] + dice.normal(0.1);
  Eigen::Matrix3d R_C_B;
  R_C_B << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
  truth.q_C_B = Eigen::Quaterniond(R_C_B) * so3_exp(dice.vector(0.07));
  truth.p_B_C = Eigen::Vector3d(0.06, 0.0, 0.01) + dice.vector(0.003);
  truth.shift_s = dice.uniform(-0.005, 0.005);
  if (hand.camera) truth = *hand.camera;
  recording.errors = draw_errors(dice, 0.002, 0.01, 0.05);
  const Path path = hand_path(dice, hand);
  truth.p_W = hand.places;
  for (int b = 0; hand.places.empty() && b < hand.boards; ++b) {
    const double azimuth = (b - 0.5 * (hand.boards - 1)) * 1.2 + dice.uniform(-0.2, 0.2);
    const double distance = dice.uniform(2.5, 5.0);
    truth.p_W.emplace_back(distance * std::cos(azimuth), distance * std::sin(azimuth),
                           dice.uniform(-0.5, 0.5));
  }
  recording.imu = imu_along(path, hand.duration_s, noise, recording.errors, dice);
  truth.M_gyro = recording.errors.S_gyro.inverse();
  truth.M_accel = recording.errors.S_accel.inverse();
  const DoubleSphere sphere(truth.lens[0], truth.lens[1]);
  const auto frames = static_cast<int>((hand.duration_s - 0.1) * hand.camera_rate_hz);
  for (int i = 4; i < frames; ++i) {
    const Timestamp stamp{from_seconds(i / hand.camera_rate_hz + 0.0013)};
    const double t = to_seconds(stamp.time_since_epoch()) + truth.shift_s;
    const Eigen::Quaterniond q_B_W = path.q_W_B(t).conjugate();
    for (std::size_t b = 0; b < truth.p_W.size(); ++b) {
      Eigen::Vector3d board = truth.p_W[b];
      if (b == 0 && t > 0.5 * hand.duration_s) board.z() += hand.moved_m;
      const Eigen::Vector3d p_B = q_B_W * (board - path.p_W(t));
      const Eigen::Vector3d p_C = truth.q_C_B * (p_B - truth.p_B_C);
      const bool is_dark = dice.uniform(0.0, 1.0) < hand.dark_share;
      const Eigen::Vector2d error(dice.normal(hand.noise_px), dice.normal(hand.noise_px));
      if (is_dark || std::acos(p_C.normalized().z()) > kHalfFov) continue;
      const auto m = sphere.project(p_C, nullptr);
      if (!m) continue;
      const Eigen::Vector2d uv = Eigen::Vector2d(truth.lens[2] * m->x(), truth.lens[3] * m->y()) +
                                 truth.lens.tail<2>() + error;
      const bool is_inside =
          uv.x() > 0.0 && uv.y() > 0.0 && uv.x() < kWidth - 1.0 && uv.y() < kHeight - 1.0;
      const bool is_hidden = hand.hides_quarter && uv.x() < 640.0 && uv.y() > 512.0;
      if (is_inside && !is_hidden)
        recording.sightings.push_back({.stamp = stamp, .board = b, .uv = uv});
    }
  }
  return recording;
}

}  // namespace crepes::simulated
