#include "estimator/calibration/grid/grid_camera.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "tests/support/grid_film.hpp"

namespace crepes::grid_camera_test {
namespace {

const ImuNoise kNoise;

struct Film {
  simulated::CameraRecording recording;
  std::vector<GridFrame> frames;
};

Film filmed(std::uint64_t seed, const GridShape& shape) {
  Film film{simulated::hand_held(seed, simulated::grid_in_hand(shape, 30.0), kNoise), {}};
  film.frames = simulated::frames_of(film.recording);
  return film;
}

/// From a lens that is half a percent off.
CameraBatchResult calibrated(const Film& film, const GridShape& shape) {
  LensVector lens = film.recording.truth.lens;
  lens[2] *= 1.005;
  lens[3] *= 1.005;
  return calibrate_grid_camera(film.recording.imu, film.frames, shape,
                               {.width = 1280,
                                .height = 1024,
                                .lens = lens,
                                .p_B_C = {0.06, 0.0, 0.01},
                                .noise = kNoise,
                                .on_progress = {}});
}

void expect_found(const CameraBatchResult& found, const simulated::CameraRecording& recording) {
  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  const Eigen::Vector3d turn = so3_log(found.constants.q_C_B.conjugate() * recording.truth.q_C_B);
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(std::abs(turn[i]), 4.0 * found.rotation_sigma_rad[i]);
    EXPECT_LT(std::abs(found.constants.p_B_C[i] - recording.truth.p_B_C[i]),
              4.0 * found.position_sigma_m[i]);
  }
  EXPECT_LT(turn.norm(), radians(0.05));
  EXPECT_LT(std::abs(found.constants.shift_s - recording.truth.shift_s), 4.0 * found.shift_sigma_s);
  EXPECT_LT(found.shift_sigma_s, 5e-5);
  EXPECT_NEAR(found.spot_sigma_px, 0.1, 0.01);
  EXPECT_LT(found.held_out_px, 0.2);
}

TEST(GridCamera, FindsLensMountingAndTimeShift) {
  constexpr GridShape kShape{.rows = 5, .columns = 7, .pitch_m = 0.05};
  const Film film = filmed(1, kShape);

  expect_found(calibrated(film, kShape), film.recording);
}

bool warns_of_pitch(const CameraBatchResult& found) {
  return std::ranges::any_of(found.warnings, [](const std::string& warning) {
    return warning.find("pitch") != std::string::npos;
  });
}

TEST(GridCamera, FindsThePitchThatIsNotAsSaid) {
  constexpr GridShape kTrue{.rows = 5, .columns = 7, .pitch_m = 0.05};
  constexpr GridShape kSaid{.rows = 5, .columns = 7, .pitch_m = 0.051};
  const Film film = filmed(2, kTrue);

  const CameraBatchResult misled = calibrated(film, kSaid);

  expect_found(misled, film.recording);
  EXPECT_NEAR(misled.constants.layout_scale, kTrue.pitch_m / kSaid.pitch_m, 0.003);
  EXPECT_TRUE(warns_of_pitch(misled));
  EXPECT_FALSE(warns_of_pitch(calibrated(film, kTrue)));
}

// Which corner of a square grid is the first, only the gyroscope knows after the grid was away.
TEST(GridCamera, KeepsCountingFromOneCornerOverGaps) {
  constexpr GridShape kShape{.rows = 6, .columns = 6, .pitch_m = 0.05};
  Film film = filmed(3, kShape);
  std::erase_if(film.frames, [](const GridFrame& frame) {
    const double t_s = to_seconds(frame.stamp.time_since_epoch());
    return std::fmod(t_s, 6.0) > 4.0;
  });

  expect_found(calibrated(film, kShape), film.recording);
}

TEST(GridCamera, RefusesStills) {
  constexpr GridShape kShape{.rows = 5, .columns = 7, .pitch_m = 0.05};
  Film film = filmed(1, kShape);
  std::vector<GridFrame> stills;
  for (std::size_t k = 0; k < film.frames.size(); k += 20) stills.push_back(film.frames[k]);
  film.frames = stills;

  const auto found = calibrated(film, kShape);

  ASSERT_FALSE(found.refusals.empty());
  EXPECT_NE(found.refusals.front().find("a film, and not stills"), std::string::npos)
      << found.refusals.front();
}

}  // namespace
}  // namespace crepes::grid_camera_test
