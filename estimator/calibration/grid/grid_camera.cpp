#include "estimator/calibration/grid/grid_camera.hpp"

#include <fmt/core.h>

#include <Eigen/LU>
#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "estimator/calibration/camera/camera_refusal.hpp"
#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/calibration/grid/grid_fit.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kLongestStep_s = 0.15;  // within which the grid turns by less than 45 deg
constexpr std::size_t kLeastSteps = 100;

/// The grid in one picture of the film.
struct FilmView {
  Timestamp stamp{};
  GridView view;
};

/// The rotation R_C1_C0 from one picture to a later one; empty if nobody knows.
using Turn = std::function<std::optional<Eigen::Quaterniond>(Timestamp from, Timestamp to)>;

bool shows_all_borders(const std::vector<GridLed>& leds, const GridShape& shape) {
  const auto [top, bottom] = std::ranges::minmax_element(leds, {}, &GridLed::row);
  const auto [left, right] = std::ranges::minmax_element(leds, {}, &GridLed::column);
  return !leds.empty() && top->row == 0 && bottom->row == shape.rows - 1 && left->column == 0 &&
         right->column == shape.columns - 1;
}

std::vector<FilmView> views_of(const std::vector<GridFrame>& frames, const GridLens& lens,
                               const GridShape& shape) {
  std::vector<FilmView> views;
  for (const GridFrame& frame : frames) {
    std::vector<GridLed> leds = find_grid(frame.lights, lens, shape);
    if (!shows_all_borders(leds, shape)) continue;
    const auto T_C_G = grid_pose(leds, lens, shape);
    if (T_C_G) views.push_back({frame.stamp, {std::move(leds), *T_C_G}});
  }
  return views;
}

/// The same picture with the LEDs counted from the next corner; of an oblong grid, from the
/// opposite one.
GridView from_next_corner(const GridView& view, const GridShape& shape) {
  const bool is_square = shape.rows == shape.columns;
  const double last_m = shape.pitch_m * (shape.rows - 1);
  GridView next = view;
  for (GridLed& led : next.leds) {
    if (is_square) {
      led.row = std::exchange(led.column, shape.rows - 1 - led.row);
    } else {
      led.row = shape.rows - 1 - led.row;
      led.column = shape.columns - 1 - led.column;
    }
  }
  // Where the new axes and origin are in the old grid.
  const Pose T_G_next = is_square
                            ? Pose{{0.0, last_m, 0.0}, so3_exp(Eigen::Vector3d(0.0, 0.0, -M_PI_2))}
                            : Pose{{shape.pitch_m * (shape.columns - 1), last_m, 0.0},
                                   so3_exp(Eigen::Vector3d(0.0, 0.0, M_PI))};
  next.T_C_G = view.T_C_G * T_G_next;
  return next;
}

/// Counts from the same corner in all views: the one that turned as `turn` says.
void agree_on_corner(std::vector<FilmView>& views, const GridShape& shape, const Turn& turn) {
  const int corners = shape.rows == shape.columns ? 4 : 2;
  for (std::size_t k = 1; k < views.size(); ++k) {
    const auto q_C1_C0 = turn(views[k - 1].stamp, views[k].stamp);
    if (!q_C1_C0) continue;
    const Eigen::Quaterniond expected = *q_C1_C0 * views[k - 1].view.T_C_G.q;
    GridView candidate = views[k].view;
    GridView best = candidate;
    for (int i = 1; i < corners; ++i) {
      candidate = from_next_corner(candidate, shape);
      if (expected.angularDistance(candidate.T_C_G.q) < expected.angularDistance(best.T_C_G.q))
        best = candidate;
    }
    views[k].view = std::move(best);
  }
}

/// Between successive pictures the grid hardly turns.
std::optional<Eigen::Quaterniond> no_turn(Timestamp from, Timestamp to) {
  if (to_seconds(to - from) > kLongestStep_s) return std::nullopt;
  return Eigen::Quaterniond::Identity();
}

std::span<const ImuSample> samples_between(std::span<const ImuSample> imu, Timestamp from,
                                           Timestamp to) {
  const auto begin = std::ranges::upper_bound(imu, from, {}, &ImuSample::stamp);
  const auto end = std::ranges::upper_bound(imu, to, {}, &ImuSample::stamp);
  return {begin, end};
}

bool is_sampled(std::span<const ImuSample> imu, const std::vector<GridFrame>& frames) {
  return !frames.empty() &&
         !samples_between(imu, frames.front().stamp, frames.back().stamp).empty();
}

/// From  w_C = A w_B - c  of successive pictures: least squares, then the nearest rotation.
std::optional<HandEye> align_grid(const std::vector<FilmView>& views,
                                  std::span<const ImuSample> imu) {
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rates;  // of camera and body
  Eigen::Vector3d mean_C = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_B = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k < views.size(); ++k) {
    const double dt = to_seconds(views[k].stamp - views[k - 1].stamp);
    const auto samples = samples_between(imu, views[k - 1].stamp, views[k].stamp);
    if (dt <= 0.0 || dt > kLongestStep_s || samples.empty()) continue;
    Eigen::Vector3d w_B = Eigen::Vector3d::Zero();
    for (const ImuSample& sample : samples)
      w_B += sample.gyro_radps / static_cast<double>(samples.size());
    const Eigen::Quaterniond q_C0_C1 =
        views[k - 1].view.T_C_G.q * views[k].view.T_C_G.q.conjugate();
    rates.emplace_back(so3_log(q_C0_C1) / dt, w_B);
    mean_C += rates.back().first;
    mean_B += w_B;
  }
  if (rates.size() < kLeastSteps) return std::nullopt;
  mean_C /= static_cast<double>(rates.size());
  mean_B /= static_cast<double>(rates.size());
  Eigen::Matrix3d CB = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d BB = Eigen::Matrix3d::Zero();
  for (const auto& [w_C, w_B] : rates) {
    CB += (w_C - mean_C) * (w_B - mean_B).transpose();
    BB += (w_B - mean_B) * (w_B - mean_B).transpose();
  }
  BB.diagonal().array() += 1e-6 * BB.trace() + 1e-12;
  const Eigen::Matrix3d A = CB * BB.inverse();
  return hand_eye_of(A, A * mean_B - mean_C);
}

/// R_B0_B1 by the gyroscope alone, forward or back in time.
Eigen::Quaterniond gyro_rotation(std::span<const ImuSample> imu, const Eigen::Vector3d& bias,
                                 Timestamp from, Timestamp to) {
  if (to < from) return gyro_rotation(imu, bias, to, from).conjugate();
  Eigen::Quaterniond q_B0_B1 = Eigen::Quaterniond::Identity();
  Timestamp last = from;
  for (const ImuSample& sample : samples_between(imu, from, to)) {
    q_B0_B1 = q_B0_B1 * so3_exp((sample.gyro_radps - bias) * to_seconds(sample.stamp - last));
    last = sample.stamp;
  }
  return q_B0_B1.normalized();
}

/// Over any gap.
Turn gyro_turn(std::span<const ImuSample> imu, const HandEye& aligned) {
  return [imu, &aligned](Timestamp from, Timestamp to) -> std::optional<Eigen::Quaterniond> {
    const Eigen::Quaterniond q_B0_B1 = gyro_rotation(imu, aligned.gyro_bias, from, to);
    return aligned.q_C_B * q_B0_B1.conjugate() * aligned.q_C_B.conjugate();
  };
}

std::vector<BoardSighting> sightings_of(const std::vector<FilmView>& views,
                                        const GridShape& shape) {
  std::vector<BoardSighting> sightings;
  for (const FilmView& film : views) {
    for (const GridLed& led : film.view.leds) {
      sightings.push_back({.stamp = film.stamp,
                           .board = static_cast<std::size_t>(led.row * shape.columns + led.column),
                           .uv = led.uv});
    }
  }
  return sightings;
}

std::vector<std::string> names_of(const GridShape& shape) {
  std::vector<std::string> names;
  for (int row = 0; row < shape.rows; ++row) {
    for (int column = 0; column < shape.columns; ++column)
      names.push_back(fmt::format("the LED in row {}, column {}", row + 1, column + 1));
  }
  return names;
}

/// The rotation from the grid to the world: gravity is what accelerometers feel in the mean.
Eigen::Quaterniond levelled(const std::vector<FilmView>& views, std::span<const ImuSample> imu,
                            const Eigen::Quaterniond& q_C_B) {
  Eigen::Vector3d up_G = Eigen::Vector3d::Zero();
  for (const FilmView& film : views) {
    const auto sample = std::ranges::lower_bound(imu, film.stamp, {}, &ImuSample::stamp);
    if (sample != imu.end()) up_G += film.view.T_C_G.q.conjugate() * (q_C_B * sample->accel_mps2);
  }
  return shortest_rotation(up_G, Eigen::Vector3d::UnitZ());
}

/// A first state in which each knot is where the nearest view has it, turned on by the gyroscope.
CameraState film_state(const CameraProblem& problem, std::span<const ImuSample> imu,
                       const std::vector<FilmView>& views, const CameraConstants& guess,
                       const Eigen::Vector3d& gyro_bias, const GridShape& shape) {
  CameraState state{.constants = guess, .knots = {}};
  const Pose T_W_G{Eigen::Vector3d::Zero(), levelled(views, imu, guess.q_C_B)};
  std::size_t near = 0;
  for (std::size_t k = 0; k < problem.knots(); ++k) {
    const Timestamp now = imu[problem.sample_of(k)].stamp;
    while (near + 1 < views.size() && views[near + 1].stamp - now < now - views[near].stamp) ++near;
    const Pose T_W_B = T_W_G * views[near].view.T_C_G.inverse() * guess.T_C_B();
    CameraKnot& knot = state.knots.emplace_back();
    knot.q_W_B = T_W_B.q * gyro_rotation(imu, gyro_bias, views[near].stamp, now);
    knot.p_W = T_W_B.p;
    knot.gyro_bias = gyro_bias;
  }
  state.constants.layout = BoardLayout::kRigid;
  for (int row = 0; row < shape.rows; ++row) {
    for (int column = 0; column < shape.columns; ++column) {
      state.constants.p_W.push_back(
          T_W_G * Eigen::Vector3d(shape.pitch_m * column, shape.pitch_m * row, 0.0));
    }
  }
  return state;
}

}  // namespace

CameraBatchResult calibrate_grid_camera(std::span<const ImuSample> imu,
                                        const std::vector<GridFrame>& frames,
                                        const GridShape& shape,
                                        const CameraBatchSettings& settings) {
  CameraBatchResult result;
  std::vector<FilmView> views =
      views_of(frames, {.kind = LensKind::kDoubleSphere, .numbers = settings.lens}, shape);
  agree_on_corner(views, shape, no_turn);
  const auto aligned = align_grid(views, imu);
  if (!aligned && !is_sampled(imu, frames)) {
    result.refusals.emplace_back(
        "no inertial samples while the pictures were taken: are the stamps of both of one clock?");
    return result;
  }
  if (!aligned) {
    result.refusals.push_back(fmt::format(
        "{} of {} pictures show the whole grid, and too few of them follow another within {} s: "
        "the mounting takes a film, and not stills",
        views.size(), frames.size(), kLongestStep_s));
    return result;
  }
  agree_on_corner(views, shape, gyro_turn(imu, *aligned));
  const std::vector<BoardSighting> sightings = sightings_of(views, shape);
  result.refusals = refusals_before_fit(imu, sightings);
  if (!result.refusals.empty()) return result;
  CameraConstants guess;
  guess.lens = settings.lens;
  guess.q_C_B = aligned->q_C_B;
  guess.p_B_C = settings.p_B_C;
  CameraProblem problem(imu, sightings, settings.noise, {});
  const CameraState start = film_state(problem, imu, views, guess, aligned->gyro_bias, shape);
  return calibrate_camera_from(start, problem, imu, names_of(shape), settings);
}

}  // namespace crepes
