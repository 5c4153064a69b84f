/// How good a camera calibration is over seeds, against the bound of its data:
/// calibration_study [SEEDS [BOARDS [chair | quarter]]]  or  calibration_study SEEDS grid
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/camera/camera_batch.hpp"
#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/calibration/grid/grid_calibration.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/core/quantile.hpp"
#include "tests/support/grid_film.hpp"

namespace crepes {
namespace {

struct Score {
  double lens_px = 0.0;
  double bound_px = 0.0;  ///< the smallest RMS that the data allow
  double rotation_deg = 0.0;
  double shift_ms = 0.0;
  double nees = 0.0;  ///< lens, rotation and shift: 10 degrees of freedom, 1 is honest
  bool is_refused = false;
  bool is_named = false;  ///< what the recording lacks: a refusal or a warning says it
};

constexpr int kDirections = 400;

/// Evenly over the image circle, camera axes.
Eigen::Vector3d direction(int k) {
  const double angle = radians(92.5) * std::sqrt((k + 0.5) / kDirections);
  return {std::sin(angle) * std::cos(2.4 * k), std::sin(angle) * std::sin(2.4 * k),
          std::cos(angle)};
}

double error_px(const CameraConstants& found, const CameraConstants& truth) {
  double sum = 0.0;
  for (int k = 0; k < kDirections; ++k) {
    const Eigen::Vector3d u_C = direction(k);
    const Eigen::Vector3d u_B = truth.q_C_B.conjugate() * u_C;
    const auto seen = project_double_sphere<double>(found.lens, found.q_C_B * u_B);
    const auto true_uv = project_double_sphere<double>(truth.lens, u_C);
    if (seen && true_uv) sum += (*seen - *true_uv).squaredNorm();
  }
  return std::sqrt(sum / kDirections);
}

/// The pixel of a body direction through a lens and a rotation that are off by `step` in the
/// constant `i`.
std::optional<Eigen::Vector2d> pixel_of(const CameraConstants& truth, const Eigen::Vector3d& u_B,
                                        int i, double step) {
  LensVector lens = truth.lens;
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  if (i < camera_constants::kRotation) {
    lens[i] += step;
  } else {
    turn[i - camera_constants::kRotation] = step;
  }
  return project_double_sphere<double>(lens, truth.q_C_B * (so3_exp(turn) * u_B));
}

/// The Cramer-Rao bound of `error_px`: what the inverse of the information of all sightings and
/// inertial samples, with everything unknown, means in pixels. The simulated noise is the model's.
double bound_px(const CameraBatchResult& found, const CameraConstants& truth) {
  constexpr int kConstants = 9;
  constexpr double kStep = 1e-6;
  const Eigen::Matrix<double, kConstants, kConstants> P =
      found.covariance.topLeftCorner<kConstants, kConstants>();
  double sum = 0.0;
  for (int k = 0; k < kDirections; ++k) {
    const Eigen::Vector3d u_B = truth.q_C_B.conjugate() * direction(k);
    Eigen::Matrix<double, 2, kConstants> J = Eigen::Matrix<double, 2, kConstants>::Zero();
    for (int i = 0; i < kConstants; ++i) {
      const auto above = pixel_of(truth, u_B, i, kStep);
      const auto below = pixel_of(truth, u_B, i, -kStep);
      if (above && below) J.col(i) = (*above - *below) / (2.0 * kStep);
    }
    sum += (J * P * J.transpose()).trace();
  }
  return std::sqrt(sum / kDirections);
}

/// Whether one of the sentences has each of the words.
bool are_named(const std::vector<std::string>& sentences, const std::vector<std::string>& words) {
  return std::ranges::all_of(words, [&](const std::string& word) {
    return std::ranges::any_of(sentences, [&](const std::string& sentence) {
      return sentence.find(word) != std::string::npos;
    });
  });
}

double nees_of(const CameraBatchResult& found, const CameraConstants& truth) {
  namespace at = camera_constants;
  constexpr int kSize = 10;
  const std::vector<Eigen::Index> rows{0, 1, 2, 3, 4, 5, 6, 7, 8, at::kShift};
  const Eigen::MatrixXd P = found.covariance(rows, rows);
  Eigen::VectorXd e(kSize);
  e << truth.lens - found.constants.lens, so3_log(found.constants.q_C_B.conjugate() * truth.q_C_B),
      truth.shift_s - found.constants.shift_s;
  return e.dot(P.ldlt().solve(e)) / kSize;
}

constexpr GridShape kGrid{.rows = 5, .columns = 7, .pitch_m = 0.05};

CameraBatchSettings settings_from(const LensVector& lens) {
  return {.width = 1280,
          .height = 1024,
          .lens = lens,
          .p_B_C = {0.06, 0.0, 0.01},
          .noise = {},
          .on_progress = {}};
}

CameraBatchResult by_boards(const simulated::CameraRecording& recording) {
  const std::vector<std::string> names(recording.truth.p_W.size(), "board");
  return calibrate_camera(recording.imu, recording.sightings, names,
                          settings_from(generic_lens(1280, 1024, radians(185.0))));
}

/// As `crepesctl calibrate camera --grid` does it, from lights instead of pictures.
CameraBatchResult by_grid(const simulated::CameraRecording& recording) {
  const std::vector<GridFrame> frames = simulated::frames_of(recording);
  std::vector<GridPicture> stills;
  for (std::size_t k = 0; k < frames.size(); k += 4) stills.push_back({"", frames[k].lights});
  const GridCalibration lens = calibrate_grid(stills, {.shape = kGrid,
                                                       .resolution = {1280, 1024},
                                                       .kind = LensKind::kDoubleSphere,
                                                       .fov_rad = radians(180.0),
                                                       .on_progress = {}});
  if (lens.covariance.size() > 0 && lens.refusals.empty())
    return calibrate_grid_camera(recording.imu, frames, kGrid, settings_from(lens.lens.numbers));
  CameraBatchResult refused;
  refused.refusals = lens.refusals;
  return refused;
}

Score trial(std::uint64_t seed, const simulated::HandHeld& hand) {
  const auto recording = simulated::hand_held(seed, hand, ImuNoise{});
  const CameraBatchResult found = hand.places.empty() ? by_boards(recording) : by_grid(recording);
  Score score{.is_refused = !found.refusals.empty()};
  if (hand.is_chair) score.is_named = are_named(found.refusals, {"about x", "about y"});
  if (hand.hides_quarter) score.is_named = are_named(found.warnings, {"lower left"});
  if (found.covariance.size() == 0) return score;
  score.lens_px = error_px(found.constants, recording.truth);
  score.bound_px = bound_px(found, recording.truth);
  score.rotation_deg = kDegPerRad * found.constants.q_C_B.angularDistance(recording.truth.q_C_B);
  score.shift_ms = 1e3 * std::abs(found.constants.shift_s - recording.truth.shift_s);
  score.nees = nees_of(found, recording.truth);
  return score;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

std::vector<double> column(const std::vector<Score>& scores, double Score::*value) {
  std::vector<double> values;
  for (const Score& score : scores) values.push_back(score.*value);
  return values;
}

double rms(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, values.size())));
}

void print_summary(const std::vector<Score>& scores) {
  const std::vector<double> lens = column(scores, &Score::lens_px);
  const std::vector<double> bound = column(scores, &Score::bound_px);
  const std::vector<double> nees = column(scores, &Score::nees);
  double mean_nees = 0.0;
  for (const double one : nees) mean_nees += one / static_cast<double>(nees.size());
  std::printf("median %6.3f  %8.3f  %12.4f  %8.4f  %5.2f  %7d  %5d\n", median(lens), median(bound),
              median(column(scores, &Score::rotation_deg)),
              median(column(scores, &Score::shift_ms)), mean_nees,
              static_cast<int>(std::ranges::count(scores, true, &Score::is_refused)),
              static_cast<int>(std::ranges::count(scores, true, &Score::is_named)));
  std::printf("RMS over the seeds: %.3f px, bound %.3f px, ratio %.2f\n", rms(lens), rms(bound),
              rms(lens) / rms(bound));
}

void run(int seeds, const simulated::HandHeld& hand) {
  std::vector<Score> scores;
  std::printf("seed  lens px  bound px  rotation deg  shift ms   nees  refused  named\n");
  for (int seed = 1; seed <= seeds; ++seed) {
    const Score& s = scores.emplace_back(trial(static_cast<std::uint64_t>(seed), hand));
    std::printf("%4d  %7.3f  %8.3f  %12.4f  %8.4f  %5.2f  %7s  %5s\n", seed, s.lens_px, s.bound_px,
                s.rotation_deg, s.shift_ms, s.nees, s.is_refused ? "yes" : "no",
                s.is_named ? "yes" : "no");
    std::fflush(stdout);
  }
  print_summary(scores);
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  crepes::simulated::HandHeld hand;
  const std::vector<std::string> words(argv + 1, argv + argc);
  const int seeds = words.empty() ? 20 : std::stoi(words[0]);
  if (words.size() > 1 && words[1] == "grid")
    hand = crepes::simulated::grid_in_hand(crepes::kGrid, 60.0);
  else if (words.size() > 1)
    hand.boards = std::stoi(words[1]);
  hand.is_chair = words.size() > 2 && words[2] == "chair";
  hand.hides_quarter = words.size() > 2 && words[2] == "quarter";
  crepes::run(seeds, hand);
}
