/// Sensors whose readings reach the daemon late.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/study/crowd.hpp"
#include "tests/study/team_trial.hpp"

namespace crepes::late_sensors_test {
namespace {

constexpr double kAfter_s = 4.0;

struct Late {
  const char* what;
  double camera_s;
  double uwb_s;
  double imu_s;
  std::vector<std::string> robots{};  ///< empty: all
};
void PrintTo(const Late& late, std::ostream* out) { *out << late.what; }

class LateSensors : public testing::TestWithParam<Late> {
 protected:
  static study::TeamQuality quality(bool graph, const SensorDelays& delays) {
    static const study::Swarm swarm =
        study::simulate_crowd({.robots = 3, .radius_m = 3.0}, 7, 14.0);
    ReplayOptions options;
    options.graph = graph;
    options.delays = delays;
    return study::quality_of(study::replay_scores(swarm, options, kAfter_s).value());
  }
};

TEST_P(LateSensors, CostHardlyAnything) {
  for (const bool graph : {false, true}) {
    SCOPED_TRACE(graph);
    const study::TeamQuality prompt = quality(graph, {});

    const study::TeamQuality late = quality(
        graph, {GetParam().robots, GetParam().camera_s, GetParam().uwb_s, GetParam().imu_s});

    EXPECT_GT(late.worst_availability, 0.99);
    EXPECT_LT(late.position_rmse_m, 1.2 * prompt.position_rmse_m);
    EXPECT_LT(late.rotation_rmse_rad, 1.2 * prompt.rotation_rmse_rad);
    EXPECT_EQ(late.gross_errors.all.beyond, 0U);
    EXPECT_EQ(late.divergences, 0U);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LateSensors,
                         testing::Values(Late{"as usual", 0.03, 0.005, 0.003},
                                         Late{"all sensors", 0.1, 0.05, 0.02},
                                         Late{"the camera of one robot", 0.08, 0.0, 0.0, {"r1"}},
                                         Late{"ranges", 0.0, 0.2, 0.0}));

}  // namespace
}  // namespace crepes::late_sensors_test
