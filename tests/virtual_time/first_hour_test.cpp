/// What somebody with two new robots does: init, record, calibrate, fly.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>
#include <string>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/calibrate/calibrate_camera.hpp"
#include "daemon/ctl/setup/init.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/core/constants.hpp"
#include "tests/study/replay_scores.hpp"
#include "tests/study/simulated_swarm.hpp"
#include "tests/support/calibration_recording.hpp"

namespace crepes::first_hour_test {
namespace {

namespace fs = std::filesystem;

constexpr double kFlight_s = 20.0;
constexpr double kAfter_s = 8.0;

/// The first of two robots, whose camera is another than its configuration guesses.
class FirstHour : public testing::Test {
 protected:
  FirstHour() {
    InitOptions options;
    options.dir = etc();
    options.id = 1;
    options.robots = 2;
    options.p_body_led = {0.06, 0.0, 0.01};
    options.p_body_uwb = {-0.04, 0.02, 0.1};
    options.search_devices = false;
    options.interface = "lo";
    std::ostringstream nobody;
    Questions questions(nullptr, nobody);
    EXPECT_TRUE(init(options, questions));
  }

  [[nodiscard]] fs::path etc() const { return scratch_.path() / "etc"; }
  [[nodiscard]] fs::path recording_dir() const { return scratch_.path() / "r1"; }
  [[nodiscard]] Config config() const { return load_config(etc() / "crepesd.yaml").value(); }

  /// Turned by 8 deg, and its focal length 10 % longer.
  [[nodiscard]] static CameraConstants real_camera(const CameraCalibration& guess) {
    CameraConstants real;
    real.lens = Eigen::Map<const LensVector>(guess.intrinsics.data());
    real.lens.segment<2>(2) *= 1.10;
    real.lens.tail<2>() += Eigen::Vector2d(9.0, -12.0);
    real.q_C_B =
        guess.T_cam_imu.q * so3_exp(radians(8.0) * Eigen::Vector3d(1.0, -1.0, 0.7).normalized());
    real.p_B_C = guess.T_cam_imu.inverse().p + Eigen::Vector3d(0.003, -0.004, 0.002);
    real.shift_s = 0.002;
    return real;
  }

  /// A minute in a hand before the other robot's board.
  void record_by_hand(const CameraConstants& camera) const {
    const auto hand = simulated::hand_held(5, {.boards = 1, .dark_share = 0.0, .camera = camera},
                                           config().imu.noise);
    const std::string pattern = config().swarm.members.at(1).pattern.value();
    std::string imu;
    for (const ImuSample& sample : hand.imu) append_rows(imu, sample);
    std::string spots;
    for (const BoardSighting& sighting : hand.sightings) {
      const double t_s = to_seconds(sighting.stamp.time_since_epoch());
      const auto slot = static_cast<std::size_t>(t_s / 10e-3) % pattern.size();
      SpotFrame frame{.stamp = sighting.stamp, .camera = 0, .spots = {}};
      if (pattern[slot] == '1')
        frame.spots.push_back({sighting.uv.x(), sighting.uv.y(), 12.0, 200.0, 1.0});
      append_rows(spots, frame);
    }
    RobotFolder folder(recording_dir());
    ASSERT_TRUE(folder.write_config(write_config(config())));
    ASSERT_TRUE(folder.append("imu0", imu));
    ASSERT_TRUE(folder.append("cam0", spots));
  }

  /// Both robots in the simulated world, the first with this camera.
  [[nodiscard]] study::Swarm fly(const CameraConstants& camera) const {
    SimConfig sim;
    sim.scenario = SimScenario::kTwo;
    sim.seed = 3;
    const SimWorld world(sim);
    auto robots = demo_swarm(sim, world.robots(), 0.0, 40000, 40100);
    for (DemoRobot& robot : robots) robot.config.swarm.members = config().swarm.members;
    CameraCalibration& calibration = robots[0].config.cameras[0].calibration;
    calibration.intrinsics.assign(camera.lens.begin(), camera.lens.end());
    calibration.T_cam_imu = camera.T_C_B();
    calibration.timeshift_cam_imu = camera.shift_s;
    auto flight = study::simulate_swarm(study::kScenarios[1], world, std::move(robots), kFlight_s);
    for (SpotFrame& frame : flight.dataset.robots[0].cameras[0].spots)
      frame.stamp -= from_seconds(camera.shift_s);
    return flight;
  }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

/// RMS errors of what the first robot knows of the second.
struct Errors {
  double position_m = 0.0;
  double rotation_rad = 0.0;
  double availability = 0.0;
};

double rms(const std::vector<double>& errors) {
  double sum = 0.0;
  for (const double error : errors) sum += error * error;
  return std::sqrt(sum / static_cast<double>(errors.size()));
}

Errors errors_of(const study::Swarm& flight, const CameraCalibration& camera) {
  study::Swarm swarm{flight.dataset, flight.truth};
  swarm.dataset.robots[0].config.cameras[0].calibration = camera;
  const auto scores = study::replay_scores(swarm, {}, kAfter_s);
  const PairScore& score = scores->at({RobotId{1}, RobotId{2}});
  return {rms(score.position_errors_m), rms(score.rotation_errors_rad), score.availability};
}

TEST_F(FirstHour, MakesOfAGuessedCameraOneWithPosesLikeThoseOfAPerfectOne) {
  const CameraCalibration guess = config().cameras.at(0).calibration;
  ASSERT_FALSE(guess.calibrated);
  const CameraConstants real = real_camera(guess);

  record_by_hand(real);
  const auto report = calibrate_camera({.robot_dir = recording_dir(),
                                        .out = etc() / "camchain-imucam.yaml",
                                        .fov_deg = {},
                                        .kannala_brandt = false,
                                        .json = false,
                                        .on_progress = {}});

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->reasons.empty()) << report->reasons.front();
  const CameraCalibration found = config().cameras.at(0).calibration;
  EXPECT_TRUE(found.calibrated);
  const study::Swarm flight = fly(real);
  CameraCalibration perfect = flight.dataset.robots[0].config.cameras[0].calibration;
  CameraCalibration trusted_guess = guess;
  trusted_guess.calibrated = true;
  const Errors with_perfect = errors_of(flight, perfect);
  const Errors with_found = errors_of(flight, found);
  const Errors with_guess = errors_of(flight, trusted_guess);
  RecordProperty("perfect_mm", std::to_string(1e3 * with_perfect.position_m));
  RecordProperty("found_mm", std::to_string(1e3 * with_found.position_m));
  EXPECT_GT(with_found.availability, 0.95);
  EXPECT_LT(with_found.position_m, 1.5 * with_perfect.position_m);
  EXPECT_LT(with_found.rotation_rad, 1.5 * with_perfect.rotation_rad);
  // Or it is refused; the guess is not good enough to fly.
  EXPECT_TRUE(with_guess.availability < 0.5 ||
              with_guess.rotation_rad > 3.0 * with_perfect.rotation_rad)
      << with_guess.availability << " " << with_guess.rotation_rad;
}

}  // namespace
}  // namespace crepes::first_hour_test
