/// Clocks that show negative times: zero is a time like any other.
#include <gtest/gtest.h>

#include "tests/study/crowd.hpp"
#include "tests/study/team_trial.hpp"

namespace crepes::negative_clocks_test {
namespace {

study::TeamQuality quality_with_clocks_at(double clocks_s) {
  constexpr double kAfter_s = 4.0;
  const study::Swarm swarm =
      study::simulate_crowd({.robots = 4, .radius_m = 3.0, .clocks_s = clocks_s}, 7, 12.0);
  return study::quality_of(study::replay_scores(swarm, {}, kAfter_s).value());
}

TEST(NegativeClocks, ChangeNothing) {
  const study::TeamQuality as_usual = quality_with_clocks_at(1000.0);

  for (const double clocks_s : {0.0, -1000.0, -1.7e9}) {
    SCOPED_TRACE(clocks_s);
    const study::TeamQuality quality = quality_with_clocks_at(clocks_s);

    EXPECT_GT(quality.worst_availability, 0.99);
    EXPECT_NEAR(quality.position_rmse_m, as_usual.position_rmse_m, 0.02 * as_usual.position_rmse_m);
    EXPECT_NEAR(quality.rotation_rmse_rad, as_usual.rotation_rmse_rad,
                0.02 * as_usual.rotation_rmse_rad);
  }
}

}  // namespace
}  // namespace crepes::negative_clocks_test
