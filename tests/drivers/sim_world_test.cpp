#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/constants.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::sim_world_test {
namespace {

using namespace std::chrono_literals;

SimWorld world_of(SimScenario scenario, int seed = 1) {
  SimConfig config;
  config.scenario = scenario;
  config.seed = seed;
  return SimWorld(config);
}

class EveryScenario : public testing::TestWithParam<Choice<SimScenario>> {
 protected:
  SimWorld world_ = world_of(GetParam().value, 7);
};

TEST_P(EveryScenario, MovesAsItsDerivativesSay) {
  constexpr double kStep = 1e-4;  // central differences: error about 1e-8 * third derivative
  for (const RobotId robot : world_.robots()) {
    for (double t = 0.3; t < 60.0; t += 1.7) {
      const BodyState state = world_.state(robot, t);
      const BodyState before = world_.state(robot, t - kStep);
      const BodyState after = world_.state(robot, t + kStep);

      const Eigen::Vector3d v = (after.T_W_B.p - before.T_W_B.p) / (2 * kStep);
      const Eigen::Vector3d a = (after.v_W_B - before.v_W_B) / (2 * kStep);
      const Eigen::Vector3d w = so3_log(before.T_W_B.q.conjugate() * after.T_W_B.q) / (2 * kStep);
      EXPECT_LT((v - state.v_W_B).norm(), 1e-6);
      EXPECT_LT((a - state.a_W_B).norm(), 1e-6);
      EXPECT_LT((w - state.w_W_B_B).norm(), 1e-5);
    }
  }
}

TEST_P(EveryScenario, KeepsRobotsApartAndFacingOneAnother) {
  const double apart_m = GetParam().value == SimScenario::kNear ? 0.4 : 1.5;
  for (double t = 0.0; t < 120.0; t += 0.25) {
    for (const RobotId a : world_.robots()) {
      for (const RobotId b : world_.robots()) {
        if (a == b) continue;
        const Pose T_B_N = world_.T_B_N(a, b, t);
        EXPECT_GT(T_B_N.p.norm(), apart_m) << t;
        if (world_.is_occluded(world_.T_W_B(a, t).p, world_.T_W_B(b, t).p)) continue;
        // Within a 185 degree camera that looks forward, also when swung about.
        EXPECT_GT(T_B_N.p.normalized().x(), std::cos(radians(92.0))) << t;
      }
    }
  }
}

TEST_P(EveryScenario, IsTheSameInEveryProcessAndAnotherWithAnotherSeed) {
  const SimWorld again = world_of(GetParam().value, 7);
  const SimWorld other = world_of(GetParam().value, 8);

  EXPECT_EQ(world_.T_W_B(RobotId{2}, 12.5).p, again.T_W_B(RobotId{2}, 12.5).p);
  EXPECT_NE(world_.T_W_B(RobotId{2}, 12.5).p, other.T_W_B(RobotId{2}, 12.5).p);
}

INSTANTIATE_TEST_SUITE_P(SimWorld, EveryScenario, testing::ValuesIn(kSimScenarios),
                         [](const auto& choice) {
                           std::string name(choice.param.name);
                           std::erase(name, '-');
                           return name;
                         });

TEST(SimWorld, LongRangeGoesOutTo27Meters) {
  const SimWorld world = world_of(SimScenario::kLongRange);
  double nearest = 100.0;
  double farthest = 0.0;
  for (double t = 0.0; t < 60.0; t += 0.1) {
    const double distance = world.T_B_N(RobotId{1}, RobotId{2}, t).p.norm();
    nearest = std::min(nearest, distance);
    farthest = std::max(farthest, distance);
  }
  EXPECT_LT(nearest, 7.0);
  EXPECT_GT(farthest, 27.0);
  EXPECT_LT(farthest, 29.0);
}

TEST(SimWorld, AggressiveTurnsHundredsOfDegreesASecond) {
  const SimWorld world = world_of(SimScenario::kAggressive);
  double fastest = 0.0;
  for (double t = 0.0; t < 60.0; t += 0.01) {
    fastest = std::max(fastest, world.state(RobotId{1}, t).w_W_B_B.norm());
  }
  EXPECT_GT(kDegPerRad * fastest, 250.0);
}

TEST(SimWorld, PillarHidesSomePairsNowAndThenAndNeighborsOnTheCircleNever) {
  const SimWorld world = world_of(SimScenario::kOccluded);
  int hidden = 0;
  int samples = 0;
  for (double t = 0.0; t < 120.0; t += 0.5, ++samples) {
    const auto p = [&](std::uint16_t id) { return world.T_W_B(RobotId{id}, t).p; };
    EXPECT_FALSE(world.is_occluded(p(1), p(2)));
    EXPECT_FALSE(world.is_occluded(p(5), p(1)));
    if (world.is_occluded(p(1), p(3))) ++hidden;
  }
  EXPECT_GT(hidden, samples / 20);
  EXPECT_LT(hidden, samples * 19 / 20);
}

TEST(SimWorld, InALineEachSeesTheNextOneAndNobodyElse) {
  for (const int seed : {1, 2, 3}) {
    const SimWorld world = world_of(SimScenario::kLine, seed);
    for (double t = 0.0; t < 120.0; t += 0.1) {
      const auto p = [&](std::uint16_t id) { return world.T_W_B(RobotId{id}, t).p; };
      EXPECT_FALSE(world.is_occluded(p(1), p(2)));
      EXPECT_FALSE(world.is_occluded(p(2), p(3)));
      EXPECT_FALSE(world.is_occluded(p(3), p(4)));
      EXPECT_TRUE(world.is_occluded(p(1), p(3)));
      EXPECT_TRUE(world.is_occluded(p(2), p(4)));
      EXPECT_TRUE(world.is_occluded(p(1), p(4)));
    }
  }
}

TEST(SimWorld, OccludesOnlyBetweenTheEnds) {
  const SimWorld world = world_of(SimScenario::kOccluded);
  EXPECT_TRUE(world.is_occluded({-3, 0, 1}, {3, 0, 1}));
  EXPECT_TRUE(world.is_occluded({3, 0.9, 1}, {-3, 0.9, 5}));
  EXPECT_FALSE(world.is_occluded({-3, 1.1, 1}, {3, 1.1, 1}));
  EXPECT_FALSE(world.is_occluded({2, 0, 1}, {5, 0, 1}));
  EXPECT_FALSE(world_of(SimScenario::kFour).is_occluded({-3, 0, 1}, {3, 0, 1}));
}

TEST(SimWorld, RobotsAtRestFeelGravityUpwards) {
  BodyState rest;
  EXPECT_DOUBLE_EQ(rest.specific_force().z(), 9.81);
}

TEST(SimClock, RunsAsItsConfigurationSays) {
  ManualClock machine;
  SimConfig config;
  config.epoch_s = 100.0;
  config.clock_offset_s = 1000.0;
  config.clock_skew_ppm = 50.0;
  const SimClock clock(machine, config);

  machine.set(Timestamp{300s});

  EXPECT_DOUBLE_EQ(clock.world_s(), 200.0);
  EXPECT_NEAR(to_seconds(clock.now().time_since_epoch()), 1200.01, 1e-9);
  EXPECT_NEAR(clock.world_time_s(clock.now()), 200.0, 1e-8);
}

}  // namespace
}  // namespace crepes::sim_world_test
