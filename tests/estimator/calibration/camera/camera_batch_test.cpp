#include "estimator/calibration/camera/camera_batch.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/calibration/batch/jet_geometry.hpp"
#include "estimator/calibration/camera/camera_start.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::camera_batch_test {
namespace {

const ImuNoise kNoise;

/// Half a minute at a quarter of the frame rate: seconds instead of a quarter of a minute.
const simulated::HandHeld kShort{.duration_s = 30.0, .camera_rate_hz = 50.0};

CameraBatchResult calibrated(const simulated::CameraRecording& recording) {
  std::vector<std::string> names;
  for (std::size_t b = 0; b < recording.truth.p_W.size(); ++b)
    names.push_back("board" + std::to_string(b + 2));
  return calibrate_camera(recording.imu, recording.sightings, names,
                          {.width = 1280,
                           .height = 1024,
                           .lens = generic_lens(1280, 1024, radians(185.0)),
                           .p_B_C = {0.06, 0.0, 0.01},
                           .noise = kNoise,
                           .on_progress = {}});
}

/// RMS over the image circle of the pixel that a direction in the body has by lens and rotation.
double error_px(const CameraConstants& found, const CameraConstants& truth) {
  double sum = 0.0;
  constexpr int kDirections = 300;
  for (int k = 0; k < kDirections; ++k) {
    const double angle = radians(92.5) * std::sqrt((k + 0.5) / kDirections);
    const Eigen::Vector3d u_C(std::sin(angle) * std::cos(2.4 * k),
                              std::sin(angle) * std::sin(2.4 * k), std::cos(angle));
    const Eigen::Vector3d u_B = truth.q_C_B.conjugate() * u_C;
    const auto seen = project_double_sphere<double>(found.lens, found.q_C_B * u_B);
    const auto true_uv = project_double_sphere<double>(truth.lens, u_C);
    if (!seen || !true_uv) return 1e3;
    sum += (*seen - *true_uv).squaredNorm();
  }
  return std::sqrt(sum / kDirections);
}

bool mentions(const std::vector<std::string>& reasons, const std::string& word) {
  for (const std::string& reason : reasons)
    if (reason.find(word) != std::string::npos) return true;
  return false;
}

/// Compares with differences of the cost.
void expect_gradient(const CameraProblem& problem, const CameraState& state,
                     const CameraState& prior) {
  const int constants = camera_constants::kBoards + board_unknowns(state.constants);
  ArrowSystem exact = problem.linearize(state, prior);
  ArrowSystem::Step step;
  step.states.assign(state.knots.size(), ArrowSystem::StateVector::Zero());
  step.constants = Eigen::VectorXd::Zero(constants);
  const auto slope = [&](double& x) {
    constexpr double h = 1e-6;
    x = h;
    const double above = problem.cost(moved(state, step), prior);
    x = -h;
    const double below = problem.cost(moved(state, step), prior);
    x = 0.0;
    return (above - below) / (2.0 * h);
  };
  for (int i = 0; i < constants; ++i) {
    const double expected = -exact.constants_gradient()(i);
    EXPECT_NEAR(slope(step.constants(i)), expected, 1e-4 * std::abs(expected) + 0.5) << i;
  }
  for (int i = 0; i < ArrowSystem::kState; ++i) {
    const double expected = -exact.gradient(5)(i);
    EXPECT_NEAR(slope(step.states[5](i)), expected, 1e-4 * std::abs(expected) + 0.5) << i;
  }
}

TEST(CameraProblem, HasTheGradientOfItsCost) {
  const auto recording =
      simulated::hand_held(3, {.duration_s = 1.5, .camera_rate_hz = 100.0, .boards = 4}, kNoise);
  const CameraProblem problem(recording.imu, recording.sightings, kNoise, {});
  for (const BoardLayout layout : {BoardLayout::kFree, BoardLayout::kRigid}) {
    CameraConstants guess = recording.truth;
    guess.p_W.clear();
    guess.layout = layout;
    const CameraState start =
        first_state(problem, recording.imu, 4, guess, Eigen::Vector3d::Zero());
    CameraState state = start;
    for (CameraKnot& knot : state.knots) knot.v_W = {0.1, -0.2, 0.05};
    expect_gradient(problem, state, start);
  }
}

TEST(CameraBatch, FindsLensMountingAndTimeShiftFromAGenericLens) {
  const auto recording = simulated::hand_held(1, kShort, kNoise);
  const CameraBatchResult found = calibrated(recording);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_LT(error_px(found.constants, recording.truth), 0.4);
  EXPECT_LT(found.constants.q_C_B.angularDistance(recording.truth.q_C_B), radians(0.06));
  EXPECT_NEAR(found.constants.shift_s, recording.truth.shift_s, 1e-4);
  EXPECT_LT((found.constants.p_B_C - recording.truth.p_B_C).norm(), 0.005);
  EXPECT_NEAR(found.spot_sigma_px, 0.16, 0.02);
  // In a held-out second only the IMU knows the path: some 0.1 px beside the spots' 0.16.
  EXPECT_LT(found.held_out_px, 1.5 * 0.16);
}

TEST(CameraBatch, RefusesATurnAboutTheVerticalAloneAndNamesWhatIsMissing) {
  simulated::HandHeld chair = kShort;
  chair.is_chair = true;
  const CameraBatchResult found = calibrated(simulated::hand_held(2, chair, kNoise));

  EXPECT_TRUE(mentions(found.refusals, "hardly turned about x (roll)"));
  EXPECT_TRUE(mentions(found.refusals, "hardly turned about y (pitch)"));
  EXPECT_FALSE(mentions(found.refusals, "about z"));
}

TEST(CameraBatch, RefusesABoardThatMoved) {
  simulated::HandHeld moved = kShort;
  moved.moved_m = 0.3;
  const CameraBatchResult found = calibrated(simulated::hand_held(3, moved, kNoise));

  EXPECT_TRUE(mentions(found.refusals, "moved"));
}

TEST(CameraBatch, FlagsAQuarterThatWasNeverSeen) {
  simulated::HandHeld hidden = kShort;
  hidden.hides_quarter = true;
  const CameraBatchResult found = calibrated(simulated::hand_held(4, hidden, kNoise));

  EXPECT_TRUE(mentions(found.warnings, "lower left quarter"));
  EXPECT_EQ(found.map.at(7, 0).count, 0U);
  EXPECT_GT(found.map.at(3, 6).count, 0U);
}

// As if the sensor had failed: what the camera saw afterwards contradicts nobody.
TEST(CameraBatch, LeavesOutWhatWasSeenWithoutInertialSamples) {
  auto recording = simulated::hand_held(1, kShort, kNoise);
  recording.imu.resize(recording.imu.size() * 3 / 4);
  const CameraBatchResult found = calibrated(recording);

  ASSERT_TRUE(found.refusals.empty()) << found.refusals.front();
  EXPECT_LT(found.outliers, 0.02);
  EXPECT_LT(error_px(found.constants, recording.truth), 0.6);
}

TEST(CameraBatch, SaysThatInertialSamplesAreOfAnotherTime) {
  auto recording = simulated::hand_held(1, kShort, kNoise);
  for (ImuSample& sample : recording.imu) sample.stamp += std::chrono::hours{1};

  EXPECT_TRUE(mentions(calibrated(recording).refusals, "of one clock"));
}

TEST(CameraBatch, RefusesWithoutBoards) {
  auto recording = simulated::hand_held(1, {.duration_s = 2.0}, kNoise);
  recording.sightings.clear();

  EXPECT_TRUE(mentions(calibrated(recording).refusals, "identified boards"));
}

}  // namespace
}  // namespace crepes::camera_batch_test
