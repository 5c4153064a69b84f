/// Sensors whose readings reach the daemon late.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/study/crowd.hpp"
#include "tests/study/team_trial.hpp"

namespace crepes::late_sensors_test {
namespace {

constexpr double kAfter_s = 4.0;
constexpr double kDuration_s = 14.0;
constexpr study::Crowd kCrowd{.robots = 3, .radius_m = 3.0};

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
  /// Of two swarms together: one alone is a tenth better or worse by chance.
  static study::TeamQuality quality(bool graph, const SensorDelays& delays) {
    static const std::array swarms{study::simulate_crowd(kCrowd, 7, kDuration_s),
                                   study::simulate_crowd(kCrowd, 8, kDuration_s)};
    ReplayOptions options;
    options.graph = graph;
    options.delays = delays;
    study::PairScores both;
    for (std::uint16_t swarm = 0; swarm < swarms.size(); ++swarm) {
      const auto scores = study::replay_scores(swarms.at(swarm), options, kAfter_s).value();
      for (const auto& [pair, score] : scores) {
        const auto id = [&](RobotId robot) {
          return RobotId{static_cast<std::uint16_t>(robot.value + 100 * swarm)};
        };
        both.emplace(study::OrderedPair(id(pair.first), id(pair.second)), score);
      }
    }
    return study::quality_of(both);
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
