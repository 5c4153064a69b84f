/// A robot whose cameras see nobody, or which has no UWB module, but which others see: it has poses
/// that are as certain as they say.
#include <gtest/gtest.h>

#include <algorithm>
#include <string_view>

#include "tests/study/simulated_swarm.hpp"
#include "tests/study/team_trial.hpp"

namespace crepes::blind_robot_test {
namespace {

study::TeamQuality quality(std::string_view scenario, int seed) {
  constexpr double kAfter_s = 5.0;
  constexpr double kDuration_s = 20.0;
  const study::Scenario& blind =
      *std::ranges::find(study::kScenarios, scenario, &study::Scenario::name);
  const study::Swarm swarm = study::simulate_swarm(blind, seed, kDuration_s);
  return study::quality_of(study::replay_scores(swarm, {}, kAfter_s).value());
}

TEST(BlindRobot, KnowsItsTeamAsWellAsItSays) {
  const study::TeamQuality found = quality("blind", 1);

  EXPECT_EQ(found.gross_errors.all.share(), 0.0);
  EXPECT_GT(found.worst_availability, 0.5);
}

TEST(BlindRobot, KnowsTheOneThatSeesItAsWellAsItSays) {
  for (const int seed : {2, 3}) {
    const study::TeamQuality found = quality("blind-pair", seed);

    EXPECT_EQ(found.gross_errors.all.share(), 0.0) << seed;
    EXPECT_GT(found.worst_availability, 0.9) << seed;
  }
}

TEST(RangelessRobot, HasATeamAllTheSame) {
  for (const int seed : {1, 2}) {
    const study::TeamQuality found = quality("rangeless", seed);

    EXPECT_EQ(found.gross_errors.all.share(), 0.0) << seed;
    EXPECT_GT(found.worst_availability, 0.95) << seed;
    EXPECT_LT(found.position_rmse_m, 0.06) << seed;
  }
}

}  // namespace
}  // namespace crepes::blind_robot_test
