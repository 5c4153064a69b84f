/// Settings that change while the estimator knows its neighbor.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/support/estimator_pair.hpp"

namespace crepes::estimator_reconfigure_test {
namespace {

using namespace std::chrono_literals;
using test::EstimatorPair;

double sigma_m(const EstimatorPair& pair) {
  return pair.latest() == nullptr
             ? 0.0
             : std::sqrt(pair.latest()->pose.T_B_N.covariance.topLeftCorner<3, 3>().trace() / 3.0);
}

TEST(EstimatorReconfigure, GoesOnWithWhatItKnowsAndTrustsTheImuLess) {
  EstimatorPair as_before(1);
  EstimatorPair reloaded(1);
  as_before.run_for(4s);
  reloaded.run_for(4s);
  ASSERT_NE(reloaded.latest(), nullptr);
  const std::uint32_t resets = reloaded.latest()->pose.reset_counter;

  reloaded.reconfigure(
      [](EstimatorSettings& settings) { settings.imu.accelerometer_noise_density *= 30; });
  reloaded.run_for(20ms);
  ASSERT_NE(reloaded.latest(), nullptr);
  EXPECT_EQ(reloaded.latest()->pose.reset_counter, resets);
  as_before.run_for(20ms + 700ms, {.in_view = false});
  reloaded.run_for(700ms, {.in_view = false});

  EXPECT_GT(sigma_m(as_before), 0.0);
  EXPECT_GT(sigma_m(reloaded), 1.3 * sigma_m(as_before));
}

TEST(EstimatorReconfigure, GatesAsConfiguredFromNowOn) {
  const auto refused = [](const EstimatorPair& pair) {
    return pair.count(MeasurementKind::kBearing, Verdict::kGated) +
           pair.count(MeasurementKind::kPeerBearing, Verdict::kGated);
  };
  EstimatorPair pair(2);
  pair.run_for(4s);
  const std::uint64_t loosely = refused(pair);

  pair.reconfigure([](EstimatorSettings& settings) { settings.filters.gate_probability = 0.9; });
  pair.run_for(2s);

  EXPECT_GT(refused(pair), loosely + 10);  // of some 400, a tenth
}

TEST(EstimatorReconfigure, StartsAnewWithAnotherProfile) {
  EstimatorPair pair(3);
  pair.run_for(4s);
  ASSERT_NE(pair.latest(), nullptr);
  const std::uint32_t resets = pair.latest()->pose.reset_counter;

  pair.reconfigure([](EstimatorSettings& settings) { settings.filters.profile = Profile::kPaper; });
  pair.run_for(20ms);
  EXPECT_EQ(pair.latest(), nullptr);
  pair.run_for(2s);

  ASSERT_NE(pair.latest(), nullptr);
  EXPECT_GT(pair.latest()->pose.reset_counter, resets);
  EXPECT_GT(pair.count(MeasurementKind::kRawPose, Verdict::kFused), 10U);
}

TEST(EstimatorReconfigure, ReadsIdsAgainAfterAChangeOfVisionAndCoastsMeanwhile) {
  EstimatorPair pair(4);
  pair.run_for(4s);
  const std::uint32_t resets = pair.found().back().pose.reset_counter;
  const std::size_t poses = pair.found().size();

  pair.reconfigure([](EstimatorSettings& settings) { settings.vision.flip_rate = 0.03; });
  pair.run_for(1s);

  EXPECT_EQ(pair.found().size(), poses + 50);
  EXPECT_EQ(pair.found().back().pose.reset_counter, resets);
  EXPECT_GT(pair.last_bearing(), pair.now() - 300ms);
}

TEST(EstimatorReconfigure, ForgetsANeighborWhoseMountingHasChanged) {
  EstimatorPair pair(5);
  pair.run_for(4s);
  ASSERT_NE(pair.latest(), nullptr);
  const std::uint32_t resets = pair.latest()->pose.reset_counter;

  pair.reconfigure(
      [](EstimatorSettings& settings) { settings.swarm.members[1].p_body_led.x() += 0.01; });
  pair.run_for(20ms);

  EXPECT_EQ(pair.latest(), nullptr);
  pair.run_for(3s);
  ASSERT_NE(pair.latest(), nullptr);
  EXPECT_GT(pair.latest()->pose.reset_counter, resets);
}

// Of an interval that was under way at the reload.
TEST(EstimatorReconfigure, ALateAnswerOfTheTeamsFilterIsIgnoredOnceItIsOff) {
  EstimatorPair pair(1);
  pair.run_for(3s);
  TeamSolution solution;
  solution.stamp = pair.own_time(pair.now()) - 200ms;
  pair.solve(solution);
  EXPECT_TRUE(pair.estimator_status().team);
  pair.reconfigure([](EstimatorSettings& settings) { settings.uses_team_filter = false; });
  pair.solve(solution);
  EXPECT_FALSE(pair.estimator_status().team);
}

TEST(EstimatorReconfigure, GoesOnUnderOtherNames) {
  EstimatorPair pair(6);
  pair.run_for(4s);
  ASSERT_NE(pair.latest(), nullptr);
  const std::size_t poses = pair.found().size();
  const std::uint32_t resets = pair.latest()->pose.reset_counter;

  pair.reconfigure([](EstimatorSettings& settings) {
    for (MemberConfig& member : settings.swarm.members) member.name += "-renamed";
  });
  pair.run_for(1s);

  EXPECT_EQ(pair.found().size(), poses + 50);
  EXPECT_EQ(pair.latest()->pose.reset_counter, resets);
  EXPECT_NE(pair.status().name.find("-renamed"), std::string::npos);
}

}  // namespace
}  // namespace crepes::estimator_reconfigure_test
