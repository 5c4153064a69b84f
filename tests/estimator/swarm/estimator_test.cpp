#include "estimator/swarm/estimator.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/support/simulated_pair.hpp"

namespace crepes::estimator_test {
namespace {

using namespace std::chrono_literals;
using test::SimulatedPair;

constexpr RobotId kSelf{1};
constexpr RobotId kOther{2};

EstimatorSettings two_robots() {
  EstimatorSettings settings;
  settings.self = kSelf;
  for (const double duty : {0.3, 0.7}) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(settings.swarm.members.size() + 1)};
    member.name = "robot" + std::to_string(member.id.value);
    member.duty = duty;
    settings.swarm.members.push_back(member);
  }
  CameraCalibration camera;
  camera.name = "cam0";
  camera.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
  camera.resolution = {1280, 1024};
  settings.cameras.push_back(camera);
  return settings;
}

/// Two seconds of what robot 1 hears: its IMU, ranges, reports and frames with one steady spot; the
/// graph places the neighbor once. In order of arrival: reports are 20 ms late.
std::vector<Event> two_seconds() {
  SimulatedPair pair(1);
  pair.sample_imus(Timestamp{2s});
  std::vector<Event> events;
  for (std::size_t i = 0; i < pair.imu_B.size(); ++i) {
    const Timestamp now = pair.imu_B[i].stamp;
    events.emplace_back(pair.imu_B[i]);
    if (i % 4 == 0) events.emplace_back(UwbRange{now, kOther, pair.range(now).range_m, -80, -79});
    if (i % 2 == 0) events.emplace_back(SpotFrame{now, 0, {{600.0, 500.0, 9.0, 200.0, 1.0}}});
    if (i % 2 == 1 && now > Timestamp{30ms}) {
      const Timestamp stamp = now - 20ms;
      ReceivedReport received;
      received.report.sender = kOther;
      received.report.stamp = stamp;
      received.report.tilt = {stamp, pair.sighting(stamp).N.up, 0.01};
      received.report.imu = {pair.imu_N[i - 3], pair.imu_N[i - 2]};
      const DirectionReading u = pair.peer_bearing(stamp);
      received.report.bearings = {{stamp, kSelf, u.u, u.camera, u.sigma_rad}};
      events.emplace_back(received);
    }
    if (now == Timestamp{500ms}) {
      GraphPose pose;
      pose.neighbor = kOther;
      pose.T_B_N = {pair.truth(now).motion.T_B_N, 0.01 * Matrix6d::Identity()};
      pose.v_B_N = pair.truth(now).motion.v_B_N;
      events.emplace_back(GraphSolution{.stamp = now, .poses = {pose}});
    }
    events.emplace_back(Tick{now});
  }
  return events;
}

std::vector<NeighborPose> poses_of(Estimator& estimator, const std::vector<Event>& events) {
  std::vector<NeighborPose> poses;
  for (const Event& event : events) {
    const Outputs outputs = estimator.step(event);
    poses.insert(poses.end(), outputs.poses.begin(), outputs.poses.end());
  }
  return poses;
}

void expect_same_to_the_bit(const std::vector<NeighborPose>& a,
                            const std::vector<NeighborPose>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].stamp, b[i].stamp);
    EXPECT_EQ(a[i].mode, b[i].mode);
    EXPECT_EQ(a[i].T_B_N.pose.p, b[i].T_B_N.pose.p);
    EXPECT_EQ(a[i].T_B_N.pose.q.coeffs(), b[i].T_B_N.pose.q.coeffs());
    EXPECT_EQ(a[i].T_B_N.covariance, b[i].T_B_N.covariance);
    EXPECT_EQ(a[i].v_B_N, b[i].v_B_N);
    EXPECT_EQ(a[i].age_s, b[i].age_s);
  }
}

TEST(Estimator, GivesTheSameOutputsToTheBitForTheSameEvents) {
  const std::vector<Event> events = two_seconds();
  Estimator one(two_robots());
  Estimator two(two_robots());

  const auto a = poses_of(one, events);
  const auto b = poses_of(two, events);

  EXPECT_GT(a.size(), 50U);
  expect_same_to_the_bit(a, b);
}

TEST(Estimator, TakesTheAntennaDelaysOfBothModulesOffEveryRange) {
  std::vector<Event> events = two_seconds();
  Estimator plain(two_robots());
  const auto expected = poses_of(plain, events);
  EstimatorSettings delayed = two_robots();
  delayed.swarm.members[0].range_delay_m = 0.1;
  delayed.swarm.members[1].range_delay_m = 0.25;
  for (Event& event : events)
    if (auto* range = std::get_if<UwbRange>(&event)) range->range_m += 0.1 + 0.25;
  Estimator estimator(delayed);

  std::vector<NeighborPose> poses;
  std::size_t reported = 0;
  for (const Event& event : events) {
    const Outputs outputs = estimator.step(event);
    poses.insert(poses.end(), outputs.poses.begin(), outputs.poses.end());
    if (!outputs.report) continue;
    for (const UwbRange& range : outputs.report->ranges) {
      // Others receive what is corrected: they need not know our delay.
      const auto is_same_range = [&](const Event& other) {
        const auto* raw = std::get_if<UwbRange>(&other);
        return raw != nullptr && raw->stamp == range.stamp &&
               std::abs(raw->range_m - 0.35 - range.range_m) < 1e-9;
      };
      EXPECT_EQ(std::ranges::count_if(events, is_same_range), 1);
      ++reported;
    }
  }

  EXPECT_GT(reported, 20U);
  ASSERT_EQ(poses.size(), expected.size());
  EXPECT_LT((poses.back().T_B_N.pose.p - expected.back().T_B_N.pose.p).norm(), 1e-6);
}

TEST(Estimator, PublishesTheDirectionOfUpWithEachPose) {
  Estimator estimator(two_robots());

  const auto poses = poses_of(estimator, two_seconds());

  ASSERT_FALSE(poses.empty());
  ASSERT_TRUE(poses.back().up_B);
  const Tilt tilt = estimator.status().tilt.value();
  EXPECT_NEAR(poses.back().up_B->norm(), 1.0, 1e-9);
  // The tilt is that of the newest sample, at most 20 ms from the pose.
  EXPECT_LT((*poses.back().up_B - tilt.up_B).norm(), 0.05);
}

TEST(Estimator, RecordsEveryMeasurementIfAskedAndGivesTheSamePoses) {
  const std::vector<Event> events = two_seconds();
  Estimator silent(two_robots());
  Estimator open(two_robots());
  open.keep_records();

  std::vector<NeighborPose> poses;
  Records records;
  for (const Event& event : events) {
    const Outputs outputs = open.step(event);
    poses.insert(poses.end(), outputs.poses.begin(), outputs.poses.end());
    for (const MeasurementRecord& one : outputs.records.measurements)
      records.measurements.push_back(one);
    for (const CalibrationRecord& one : outputs.records.calibrations)
      records.calibrations.push_back(one);
  }

  expect_same_to_the_bit(poses, poses_of(silent, events));
  const NeighborStatus status = open.status().neighbors.at(0);
  std::array<VerdictCounts, kMeasurementKindCount> reported{};
  for (const MeasurementRecord& one : records.measurements) {
    EXPECT_EQ(one.neighbor, kOther);
    ++reported.at(static_cast<std::size_t>(one.kind))
          .at(static_cast<std::size_t>(one.fusion.verdict));
    if (one.kind == MeasurementKind::kRange && one.fusion.verdict == Verdict::kFused) {
      EXPECT_EQ(one.fusion.dimension, 1U);
      EXPECT_GT(one.fusion.sigma[0], 0.0);
    }
  }
  EXPECT_EQ(reported, status.measurements);
  ASSERT_FALSE(records.calibrations.empty());
  // The first belief is the prior.
  EXPECT_NEAR(records.calibrations.front().sigma[0], ImuNoise{}.gyroscope_bias_sigma, 1e-3);
}

TEST(Estimator, CountsReportsOfUnknownSendersAndIgnoresThem) {
  Estimator estimator(two_robots());
  ReceivedReport stranger;
  stranger.report.sender = RobotId{99};
  ReceivedReport echo;
  echo.report.sender = kSelf;

  static_cast<void>(estimator.step(stranger));
  static_cast<void>(estimator.step(echo));

  EXPECT_EQ(estimator.status().unknown_senders, 2U);
  ASSERT_EQ(estimator.status().neighbors.size(), 1U);
  EXPECT_EQ(estimator.status().neighbors[0].reason, NoPoseReason::kNeverHeard);
}

TEST(Estimator, RefusesATickThatDoesNotAdvance) {
  Estimator estimator(two_robots());
  static_cast<void>(estimator.step(Tick{Timestamp{1s}}));

  EXPECT_TRUE(estimator.step(Tick{Timestamp{1s}}).poses.empty());
  EXPECT_TRUE(estimator.step(Tick{Timestamp{500ms}}).poses.empty());

  EXPECT_EQ(estimator.status().refused_samples, 2U);
}

TEST(Estimator, PublishesNoInstantTwiceWhereTicksAreFasterThanItsImu) {
  std::vector<Event> events;
  for (const Event& event : two_seconds()) {
    events.push_back(event);
    if (const auto* tick = std::get_if<Tick>(&event)) events.emplace_back(Tick{tick->stamp + 5ms});
  }
  Estimator estimator(two_robots());

  const std::vector<NeighborPose> poses = poses_of(estimator, events);

  ASSERT_GT(poses.size(), 100U);
  EXPECT_EQ(std::ranges::adjacent_find(poses, std::ranges::greater_equal{}, &NeighborPose::stamp),
            poses.end());
}

/// Readings that mean nothing, to be strewn among good ones.
std::vector<Event> nonsense(Timestamp stamp) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector3d bad = Eigen::Vector3d::Constant(nan);
  const Eigen::Vector3d zero = Eigen::Vector3d::Zero();
  return {ImuSample{stamp + 1ms, bad, zero},
          ImuSample{stamp + 1ms, zero, bad},
          ImuSample{stamp + 1ms, Eigen::Vector3d::Constant(1e200), zero},
          ImuSample{stamp - 5ms, zero, zero},
          UwbRange{stamp, kOther, nan, -80, -79},
          UwbRange{stamp, RobotId{77}, 3.0, -80, -79},
          SpotFrame{stamp, 9, {}},
          Tick{stamp - 1s}};
}

TEST(Estimator, RefusesNonsenseAndLosesNothingElse) {
  const std::vector<Event> clean = two_seconds();
  std::vector<Event> dirty;
  std::uint64_t strewn = 0;
  for (const Event& event : clean) {
    dirty.push_back(event);
    const bool tick = std::holds_alternative<Tick>(event);
    if (!tick || stamp_of(event).time_since_epoch() % 100ms != 0ms) continue;
    for (const Event& bad : nonsense(stamp_of(event))) {
      dirty.push_back(bad);
      ++strewn;
    }
  }
  Estimator one(two_robots());
  Estimator two(two_robots());

  const auto expected = poses_of(one, clean);
  const auto poses = poses_of(two, dirty);

  EXPECT_GT(expected.size(), 50U);
  expect_same_to_the_bit(expected, poses);
  EXPECT_EQ(one.status().refused_samples, 0U);
  EXPECT_EQ(two.status().refused_samples, strewn);
}

TEST(Estimator, ReportsAtItsRateOnceItKnowsItsTilt) {
  Estimator estimator(two_robots());
  int reports = 0;
  for (const Event& event : two_seconds()) {
    const Outputs outputs = estimator.step(event);
    if (!outputs.report) continue;
    ++reports;
    EXPECT_EQ(outputs.report->sender, kSelf);
    EXPECT_FALSE(outputs.report->imu.empty());
  }

  // 50 Hz less the first samples, before there is a tilt.
  EXPECT_GT(reports, 80);
  EXPECT_LE(reports, 101);
  EXPECT_TRUE(estimator.status().tilt);
}

TEST(Estimator, SurvivesExtremeStamps) {
  Estimator estimator(two_robots());
  const Timestamp last = Timestamp{Duration{std::numeric_limits<std::int64_t>::max() / 8}};
  ReceivedReport received;
  received.report.sender = kOther;
  received.report.stamp = last;
  received.report.tilt.stamp = Timestamp{};
  received.report.bearings = {{last, kSelf, Eigen::Vector3d::UnitX(), {0, 0, 0}, 0.01}};
  for (const Event& event : two_seconds()) static_cast<void>(estimator.step(event));

  static_cast<void>(estimator.step(received));
  static_cast<void>(estimator.step(SpotFrame{last, 0, {{600.0, 500.0, 9.0, 200.0, 1.0}}}));
  static_cast<void>(estimator.step(UwbRange{last, kOther, 3.0, -80, -79}));
  static_cast<void>(estimator.step(Tick{Timestamp{2100ms}}));

  EXPECT_EQ(estimator.status().neighbors.size(), 1U);
}

}  // namespace
}  // namespace crepes::estimator_test
