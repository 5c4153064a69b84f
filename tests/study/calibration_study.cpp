/// How good a camera calibration is over seeds: calibration_study [SEEDS [BOARDS [chair]]]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "estimator/calibration/camera_batch.hpp"
#include "estimator/calibration/camera_start.hpp"
#include "estimator/calibration/jet_geometry.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes {
namespace {

struct Score {
  double lens_px = 0.0;
  double rotation_deg = 0.0;
  double shift_ms = 0.0;
  double nees = 0.0;  ///< lens, rotation and shift: 10 degrees of freedom, 1 is honest
  bool is_refused = false;
};

double error_px(const CameraConstants& found, const CameraConstants& truth) {
  constexpr int kDirections = 400;
  double sum = 0.0;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = radians(92.5) * std::sqrt((k + 0.5) / kDirections);
    const Eigen::Vector3d u_C(std::sin(angle) * std::cos(2.4 * k),
                              std::sin(angle) * std::sin(2.4 * k), std::cos(angle));
    const Eigen::Vector3d u_B = truth.q_C_B.conjugate() * u_C;
    const auto seen = project_double_sphere<double>(found.lens, found.q_C_B * u_B);
    const auto true_uv = project_double_sphere<double>(truth.lens, u_C);
    if (seen && true_uv) sum += (*seen - *true_uv).squaredNorm();
  }
  return std::sqrt(sum / kDirections);
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

Score trial(std::uint64_t seed, const simulated::HandHeld& hand) {
  const ImuNoise noise;
  const auto recording = simulated::hand_held(seed, hand, noise);
  const std::vector<std::string> names(recording.truth.p_W.size(), "board");
  const CameraBatchResult found =
      calibrate_camera(recording.imu, recording.sightings, names,
                       {.width = 1280,
                        .height = 1024,
                        .lens = generic_lens(1280, 1024, radians(185.0)),
                        .p_B_C = {0.06, 0.0, 0.01},
                        .noise = noise,
                        .on_progress = {}});
  Score score{.is_refused = !found.refusals.empty()};
  if (found.covariance.size() == 0) return score;
  score.lens_px = error_px(found.constants, recording.truth);
  score.rotation_deg = kDegPerRad * found.constants.q_C_B.angularDistance(recording.truth.q_C_B);
  score.shift_ms = 1e3 * std::abs(found.constants.shift_s - recording.truth.shift_s);
  score.nees = nees_of(found, recording.truth);
  return score;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[values.size() / 2];
}

void run(int seeds, const simulated::HandHeld& hand) {
  std::vector<double> lens;
  std::vector<double> rotation;
  std::vector<double> shift;
  double nees = 0.0;
  int refused = 0;
  std::printf("seed  lens px  rotation deg  shift ms   nees  refused\n");
  for (int seed = 1; seed <= seeds; ++seed) {
    const Score s = trial(static_cast<std::uint64_t>(seed), hand);
    std::printf("%4d  %7.3f  %12.4f  %8.4f  %5.2f  %7s\n", seed, s.lens_px, s.rotation_deg,
                s.shift_ms, s.nees, s.is_refused ? "yes" : "no");
    std::fflush(stdout);
    lens.push_back(s.lens_px);
    rotation.push_back(s.rotation_deg);
    shift.push_back(s.shift_ms);
    nees += s.nees / seeds;
    refused += s.is_refused ? 1 : 0;
  }
  std::printf("median %6.3f  %12.4f  %8.4f  %5.2f  %7d\n", median(lens), median(rotation),
              median(shift), nees, refused);
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  crepes::simulated::HandHeld hand;
  const std::vector<std::string> words(argv + 1, argv + argc);
  const int seeds = words.empty() ? 20 : std::stoi(words[0]);
  if (words.size() > 1) hand.boards = std::stoi(words[1]);
  hand.is_chair = words.size() > 2 && words[2] == "chair";
  crepes::run(seeds, hand);
}
