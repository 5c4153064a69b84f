#include "drivers/sim/ring_renderer.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>

#include "drivers/sim/sim_camera.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "tests/support/forward_camera.hpp"
#include "tests/support/manual_clock.hpp"

namespace crepes::ring_renderer_test {
namespace {

using namespace std::chrono_literals;

SwarmConfig swarm_of(int count) {
  SwarmConfig swarm;
  for (int i = 1; i <= count; ++i) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(i)};
    member.name = "r" + std::to_string(i);
    member.duty = 0.2 + 0.1 * i;
    member.p_body_led = {0.05, 0.0, 0.01};
    swarm.members.push_back(member);
  }
  return swarm;
}

SimConfig config_of(SimScenario scenario) {
  SimConfig config;
  config.scenario = scenario;
  return config;
}

RingRenderer renderer_for(const SimWorld& world, const SwarmConfig& swarm) {
  auto renderer = RingRenderer::make(world, RobotId{1}, swarm, forward_camera(), 0);
  EXPECT_TRUE(renderer) << renderer.error().message;
  return std::move(*renderer);
}

struct Centroid {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double weight = 0.0;
};

/// Of the light within `radius` of `around`, above the background.
Centroid centroid(const Frame& frame, const Eigen::Vector2d& around, int radius) {
  constexpr int kBackground = 20;
  Centroid sum;
  for (int v = static_cast<int>(around.y()) - radius; v <= around.y() + radius; ++v) {
    for (int u = static_cast<int>(around.x()) - radius; u <= around.x() + radius; ++u) {
      const int level = frame.pixels.at(static_cast<std::size_t>(v * frame.width + u));
      if (level <= kBackground) continue;
      sum.center += (level - kBackground) * Eigen::Vector2d(u, v);
      sum.weight += level - kBackground;
    }
  }
  sum.center /= sum.weight;
  return sum;
}

TEST(RingRenderer, PutsTheCentroidOfARingWhereItsCenterProjects) {
  const SimWorld world(config_of(SimScenario::kTwo));
  auto renderer = renderer_for(world, swarm_of(2));
  double square_sum = 0.0;
  int lit = 0;
  for (double t = 0.0; t < 20.0; t += 0.0317) {
    const auto center = renderer.project_ring(RobotId{2}, t);
    ASSERT_TRUE(center);
    Frame frame = renderer.render(t);
    const Centroid seen = centroid(frame, *center, 15);
    if (seen.weight > 1000.0) {
      square_sum += (seen.center - *center).squaredNorm();
      EXPECT_LT((seen.center - *center).norm(), 0.1) << t;
      ++lit;
    }
    renderer.recycle(std::move(frame));
  }
  EXPECT_NEAR(lit, 631 * 0.4, 60);  // the board's duty is 0.4
  EXPECT_LT(std::sqrt(square_sum / lit), 0.03);
}

TEST(RingRenderer, ShowsSixBlobsNearbyAndOneFarAwayAndDimmer) {
  const SimWorld world(config_of(SimScenario::kLongRange));
  auto renderer = renderer_for(world, swarm_of(2));
  const auto brightest_light = [&](double from) {
    double most = 0.0;
    for (double t = from; t < from + 0.05; t += 0.005) {
      const auto center = renderer.project_ring(RobotId{2}, t);
      most = std::max(most, centroid(renderer.render(t), *center, 15).weight);
    }
    return most;
  };
  const double near = brightest_light(0.0);
  const double far = brightest_light(30.0);
  EXPECT_GT(far, 100.0);
  EXPECT_GT(near, 8.0 * far);
}

// The noise away from boards stands still, so a peak in it is a light until it is known as hot.
TEST(RingRenderer, IsFoundByTheDetectorFromFiveTo27Meters) {
  constexpr int kUntilHotIsKnown = 410;  // pictures
  const SimWorld world(config_of(SimScenario::kLongRange));
  auto renderer = renderer_for(world, swarm_of(2));
  SpotDetector detector{VisionConfig{}};
  const auto spots_at = [&](double shutter) {
    const Frame frame = renderer.render(shutter);
    return detector
        .detect({.pixels = frame.pixels.data(),
                 .width = frame.width,
                 .height = frame.height,
                 .stride = frame.width})
        .spots;
  };
  for (int k = 0; k < kUntilHotIsKnown; ++k) static_cast<void>(spots_at(0.005 * k));
  for (double t = 0.0; t < 30.0; t += 1.5) {
    int found = 0;
    for (int k = 0; k < 10; ++k) {
      const double shutter = t + 0.005 * k;
      const auto center = renderer.project_ring(RobotId{2}, shutter);
      for (const Spot& spot : spots_at(shutter)) {
        EXPECT_LT((Eigen::Vector2d(spot.u_px, spot.v_px) - *center).norm(), 0.5) << shutter;
        ++found;
      }
    }
    EXPECT_GE(found, 3) << t;  // a duty of 0.4 in ten frames, one period
    EXPECT_LE(found, 5) << t;
  }
}

TEST(RingRenderer, RestoresRecycledFramesToTheBackground) {
  const SimWorld world(config_of(SimScenario::kFour));
  auto recycling = renderer_for(world, swarm_of(4));
  auto wasteful = renderer_for(world, swarm_of(4));
  for (double t = 0.0; t < 0.5; t += 0.005) {
    Frame frame = recycling.render(t);
    ASSERT_EQ(frame.pixels, wasteful.render(t).pixels) << t;
    recycling.recycle(std::move(frame));
  }
}

TEST(RingRenderer, TakesBackOnlyItsOwnFrames) {
  const SimWorld world(config_of(SimScenario::kTwo));
  auto renderer = renderer_for(world, swarm_of(2));
  const Frame reference = renderer.render(0.0);

  Frame foreign;
  foreign.pixels.assign(reference.pixels.size(), 255);
  renderer.recycle(std::move(foreign));

  const Frame next = renderer.render(0.005);
  EXPECT_LT(std::accumulate(next.pixels.begin(), next.pixels.end(), 0.0) / 1280 / 1024, 20.0);
}

TEST(RingRenderer, HidesBoardsBehindThePillar) {
  const SimWorld world(config_of(SimScenario::kOccluded));
  auto renderer = renderer_for(world, swarm_of(5));
  int hidden = 0;
  for (double t = 0.0; t < 60.0; t += 0.5) {
    if (!renderer.project_ring(RobotId{3}, t)) ++hidden;
    EXPECT_TRUE(renderer.project_ring(RobotId{2}, t));
  }
  EXPECT_GT(hidden, 10);
}

TEST(RingRenderer, RefusesCamerasAndMembersThatDoNotWork) {
  const SimWorld world(config_of(SimScenario::kTwo));
  auto camera = forward_camera();
  camera.intrinsics.clear();
  EXPECT_FALSE(RingRenderer::make(world, RobotId{1}, swarm_of(2), camera, 0));
  EXPECT_FALSE(RingRenderer::make(world, RobotId{1}, swarm_of(3), forward_camera(), 0));
  auto swarm = swarm_of(2);
  swarm.members[1].duty.reset();
  EXPECT_FALSE(RingRenderer::make(world, RobotId{1}, swarm, forward_camera(), 0));
}

TEST(RingRenderer, ExposesRowAfterRowWhereTheShutterRolls) {
  constexpr double kRow = 10e-6;  // s
  const SimWorld world(config_of(SimScenario::kTwo));
  auto camera = forward_camera();
  camera.rolling_shutter_us_per_row = 1e6 * kRow;
  const auto rolling = RingRenderer::make(world, RobotId{1}, swarm_of(2), camera, 0);
  const auto global = renderer_for(world, swarm_of(2));
  ASSERT_TRUE(rolling);
  double farthest_row = 0.0;
  for (double t = 0.0; t < 20.0; t += 0.0317) {
    for (const RingRenderer::View& view : rolling->views(t)) {
      const double after = view.spot.v_px - 0.5 * (camera.resolution[1] - 1);
      const auto uv = global.project_ring(view.robot, t + kRow * after);
      ASSERT_TRUE(uv);
      EXPECT_LT((*uv - Eigen::Vector2d(view.spot.u_px, view.spot.v_px)).norm(), 0.002);
      farthest_row = std::max(farthest_row, std::abs(after));
    }
  }
  EXPECT_GT(farthest_row, 30.0) << "or nothing was tested";
}

TEST(SimCamera, KeepsItsBeatAndMissesFramesRatherThanFallBehind) {
  const SimWorld world(config_of(SimScenario::kTwo));
  ManualClock machine;
  machine.set(Timestamp{1s});
  SimConfig config;
  config.clock_offset_s = 10.0;
  const SimClock clock(machine, config);
  auto settings = forward_camera();
  settings.timeshift_cam_imu = 0.001;
  SimCamera camera(renderer_for(world, swarm_of(2)), settings, clock);

  const auto first = camera.read_once(0ms);
  const auto too_early = camera.read_once(0ms);
  machine.advance(21ms);
  const auto late = camera.read_once(0ms);

  ASSERT_TRUE(first && *first);
  EXPECT_NEAR(to_seconds((*first)->stamp.time_since_epoch()), 10.999, 1e-8);
  EXPECT_TRUE(too_early && !*too_early);
  ASSERT_TRUE(late && *late);
  EXPECT_NEAR(to_seconds((*late)->stamp.time_since_epoch()), 11.019, 1e-8);
  EXPECT_EQ(camera.counters().counts, (Totals{{"frames", 2}, {"superseded", 3}}));
  EXPECT_TRUE(camera.counters().faults.empty());
}

}  // namespace
}  // namespace crepes::ring_renderer_test
