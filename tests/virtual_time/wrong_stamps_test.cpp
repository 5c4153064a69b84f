/// Pictures whose stamps are half a millisecond late, on robots that turn fast.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "tests/study/team_trial.hpp"

namespace crepes::wrong_stamps_test {
namespace {

study::Swarm with_late_stamps(study::Swarm swarm) {
  for (RobotRecording& robot : swarm.dataset.robots)
    for (CameraRecording& camera : robot.cameras)
      for (SpotFrame& frame : camera.spots) frame.stamp += std::chrono::microseconds{500};
  return swarm;
}

/// Of all poses of four swarms.
GrossErrors beyond_5_sigma(double stamp_sigma_ms) {
  const study::Scenario& aggressive =
      *std::ranges::find(study::kScenarios, "aggressive", &study::Scenario::name);
  GrossErrorsByMode all;
  for (int seed = 9; seed <= 12; ++seed) {
    study::Swarm swarm = with_late_stamps(study::simulate_swarm(aggressive, seed, 12.0));
    for (RobotRecording& robot : swarm.dataset.robots)
      robot.config.vision.stamp_sigma_ms = stamp_sigma_ms;
    merge(all, study::quality_of(study::replay_scores(swarm, {}, 5.0).value()).gross_errors);
  }
  return all.all;
}

TEST(WrongStamps, AreAllowedFor) {
  const GrossErrors usual = beyond_5_sigma(VisionConfig{}.stamp_sigma_ms);
  EXPECT_LT(usual.share(), 0.01);
  EXPECT_LT(to_seconds(usual.longest_run), 0.5);

  EXPECT_GT(beyond_5_sigma(0.0).share(), 0.05);
}

}  // namespace
}  // namespace crepes::wrong_stamps_test
