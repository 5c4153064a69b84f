/// Simulated robots that fly in view of each other, for the calibration of a swarm. Written apart
/// from what calibrates: paths are sums of sines, see calibration_recording.hpp.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "estimator/calibration/swarm/swarm_batch.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::simulated {

struct Flight {
  int robots = 3;
  double duration_s = 20.0;
  double camera_rate_hz = 50.0;
  double range_rate_hz = 20.0;
  double noise_px = 0.15;
  double range_noise_m = 0.05;
  double outliers = 0.02;     ///< of sightings and ranges
  double pair_bias_m = 0.0;   ///< of ranges, one sigma, beside both delays
  double pair_drift_m = 0.0;  ///< amplitude, within some ten seconds
};

/// What a calibration is given, and the truth.
struct SwarmFlight {
  std::vector<RobotRecord> records;
  std::vector<RobotConstants> guess;
  SwarmStart start;
  std::vector<RobotConstants> truth;
  std::vector<std::string> names;
};

/// About a place on a circle, always facing its middle but for some turns.
inline Path flight_path(Dice& dice, int robot, int robots) {
  const double angle = 2.0 * std::numbers::pi * robot / robots;
  const Eigen::Vector3d center(2.5 * std::cos(angle), 2.5 * std::sin(angle), 1.5);
  std::array<double, 12> w{};
  std::array<double, 12> phase{};
  for (std::size_t i = 0; i < w.size(); ++i) {
    w[i] = dice.uniform(0.8, 2.5);
    phase[i] = dice.uniform(0.0, 2.0 * std::numbers::pi);
  }
  const auto wave = [w, phase](std::size_t i, double t) { return std::sin(w[i] * t + phase[i]); };
  Path path;
  path.p_W = [center, wave](double t) {
    return Eigen::Vector3d(center + Eigen::Vector3d(0.5 * wave(0, t) + 0.2 * wave(1, t),
                                                    0.5 * wave(2, t) + 0.2 * wave(3, t),
                                                    0.4 * wave(4, t) + 0.2 * wave(5, t)));
  };
  path.q_W_B = [angle, wave](double t) {
    return Eigen::Quaterniond(
        Eigen::AngleAxisd(angle + std::numbers::pi + 0.3 * wave(6, t), Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(0.25 * wave(7, t) + 0.1 * wave(8, t), Eigen::Vector3d::UnitY()) *
        Eigen::AngleAxisd(0.25 * wave(9, t) + 0.1 * wave(10, t), Eigen::Vector3d::UnitX()));
  };
  return path;
}

inline RobotConstants nominal_robot() {
  RobotConstants robot;
  robot.camera.lens << -0.2, 0.6, 320.0, 320.0, 639.5, 511.5;
  Eigen::Matrix3d R_C_B;
  R_C_B << 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 1.0, 0.0, 0.0;
  robot.camera.q_C_B = Eigen::Quaterniond(R_C_B);
  robot.camera.p_B_C = {0.06, 0.0, 0.01};
  robot.p_B_M = {0.05, 0.0, 0.01};
  robot.p_B_U = {-0.04, 0.02, 0.1};
  return robot;
}

/// A robot as it was built: off by what `default_robot_priors` expects, or somewhat less.
inline RobotConstants built_robot(Dice& dice) {
  RobotConstants robot = nominal_robot();
  CameraConstants& camera = robot.camera;
  camera.lens += (LensVector() << dice.normal(0.01), dice.normal(0.004), dice.normal(2.0), 0.0,
                  dice.normal(1.5), dice.normal(1.5))
                     .finished();
  camera.lens[3] = camera.lens[2] + dice.normal(0.2);
  camera.q_C_B = camera.q_C_B * so3_exp(dice.vector(0.025));
  camera.p_B_C += dice.vector(0.02);
  camera.shift_s = dice.uniform(-0.005, 0.005);
  robot.p_B_M += dice.vector(0.02);
  robot.p_B_U += dice.vector(0.02);
  robot.range_delay_m = dice.normal(0.1);
  return robot;
}

inline std::optional<Eigen::Vector2d> simulated_spot(const CameraConstants& camera,
                                                     const Eigen::Vector3d& p_B) {
  const DoubleSphere sphere(camera.lens[0], camera.lens[1]);
  const auto m = sphere.project(camera.q_C_B * (p_B - camera.p_B_C), nullptr);
  if (!m) return std::nullopt;
  const Eigen::Vector2d uv(camera.lens[2] * m->x() + camera.lens[4],
                           camera.lens[3] * m->y() + camera.lens[5]);
  const bool is_inside = uv.x() > 0.0 && uv.y() > 0.0 && uv.x() < 1279.0 && uv.y() < 1023.0;
  return is_inside ? std::optional(uv) : std::nullopt;
}

inline SwarmFlight fly(std::uint64_t seed, const Flight& flight, const ImuNoise& noise) {
  constexpr double kMargin = 0.2;
  Dice dice(seed);
  SwarmFlight all;
  std::vector<Path> paths;
  const auto count = static_cast<std::size_t>(flight.robots);
  for (std::size_t r = 0; r < count; ++r) {
    paths.push_back(flight_path(dice, static_cast<int>(r), flight.robots));
    all.truth.push_back(built_robot(dice));
    all.guess.push_back(nominal_robot());
    all.names.push_back("r" + std::to_string(r + 1));
    ImuErrors errors = draw_errors(dice, 0.002, 0.005, 0.03);
    RobotRecord record{.imu = imu_along(paths[r], flight.duration_s, noise, errors, dice),
                       .sightings = {},
                       .ranges = {},
                       .noise = noise,
                       .range_noise = {}};
    all.truth[r].camera.M_gyro = errors.S_gyro.inverse();
    all.truth[r].camera.M_accel = errors.S_accel.inverse();
    all.records.push_back(std::move(record));
  }
  const auto spot_noise = [&] {
    const double sigma = dice.uniform(0.0, 1.0) < flight.outliers ? 30.0 : flight.noise_px;
    return Eigen::Vector2d(dice.normal(sigma), dice.normal(sigma));
  };
  std::vector<double> bias(pair_count(count));
  std::vector<double> phase(pair_count(count));
  for (double& b : bias) b = flight.pair_bias_m > 0.0 ? dice.normal(flight.pair_bias_m) : 0.0;
  for (double& p : phase)
    p = flight.pair_drift_m > 0.0 ? dice.uniform(0.0, 2.0 * std::numbers::pi) : 0.0;
  const auto pair_part = [&](std::size_t a, std::size_t b, double t) {
    const std::size_t pair = pair_index(a, b, count);
    return bias[pair] + flight.pair_drift_m * std::sin(t / 10.0 + phase[pair]);
  };
  for (std::size_t o = 0; o < count; ++o) {
    const RobotConstants& own = all.truth[o];
    for (double stamp = kMargin; stamp < flight.duration_s - kMargin;
         stamp += 1.0 / flight.camera_rate_hz) {
      const double t = stamp + own.camera.shift_s;
      for (std::size_t n = 0; n < count; ++n) {
        if (n == o) continue;
        const Eigen::Vector3d ring = paths[n].p_W(t) + paths[n].q_W_B(t) * all.truth[n].p_B_M;
        const auto uv =
            simulated_spot(own.camera, paths[o].q_W_B(t).conjugate() * (ring - paths[o].p_W(t)));
        if (uv)
          all.records[o].sightings.push_back(
              {.stamp = Timestamp{from_seconds(stamp)}, .board = n, .uv = *uv + spot_noise()});
      }
    }
    for (double t = kMargin; t < flight.duration_s - kMargin; t += 1.0 / flight.range_rate_hz) {
      for (std::size_t n = 0; n < count; ++n) {
        if (n == o) continue;
        const double late = dice.uniform(0.0, 1.0) < flight.outliers ? 2.0 : 0.0;
        const Eigen::Vector3d way = paths[n].p_W(t) + paths[n].q_W_B(t) * all.truth[n].p_B_U -
                                    paths[o].p_W(t) - paths[o].q_W_B(t) * own.p_B_U;
        all.records[o].ranges.push_back(
            {.stamp = Timestamp{from_seconds(t)},
             .other = n,
             .range_m = way.norm() + own.range_delay_m + all.truth[n].range_delay_m + late +
                        pair_part(o, n, t) + dice.normal(flight.range_noise_m)});
      }
    }
  }
  // What an estimator with the guess has: a decimeter and a degree off, and slowly changing.
  all.start.poses.resize(count);
  std::vector<Pose> error(count);
  for (Pose& e : error) e = {dice.vector(0.06), so3_exp(dice.vector(0.012))};
  for (double t = 0.1; t < flight.duration_s - 0.1; t += 0.02) {
    const Eigen::Quaterniond q_B_W = paths[0].q_W_B(t).conjugate();
    const Timestamp stamp{from_seconds(t)};
    all.start.up.push_back({stamp, q_B_W * Eigen::Vector3d::UnitZ()});
    for (std::size_t n = 1; n < count; ++n) {
      const Pose T_B_N{q_B_W * (paths[n].p_W(t) - paths[0].p_W(t)), q_B_W * paths[n].q_W_B(t)};
      const auto relative = [&](double s) {
        return Eigen::Vector3d(paths[n].p_W(s) - paths[0].p_W(s));
      };
      const Eigen::Vector3d v = (relative(t + 1e-3) - relative(t - 1e-3)) / 2e-3;
      all.start.poses[n].push_back(
          {stamp, {T_B_N.p + error[n].p, T_B_N.q * error[n].q}, q_B_W * v});
    }
  }
  return all;
}

}  // namespace crepes::simulated
