#include "daemon/ctl/dataset/truth.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/daemon/ctl/tiny_swarm.hpp"

namespace crepes::truth_test {
namespace {

using Eigen::Vector3d;

Eigen::Quaterniond about_z(double angle) { return so3_exp({0.0, 0.0, angle}); }

TEST(Trajectory, InterpolatesPositionLinearlyAndAttitudeAlongTheArc) {
  const Trajectory path({{0.0, {Vector3d(0, 0, 0), about_z(0.0)}},
                         {1.0, {Vector3d(4, 0, -2), Eigen::Quaterniond(-about_z(0.8).coeffs())}}});

  const Pose T_W_B = path.at(0.25).value();

  EXPECT_NEAR((T_W_B.p - Vector3d(1, 0, -0.5)).norm(), 0.0, 1e-12);
  EXPECT_NEAR(T_W_B.q.angularDistance(about_z(0.2)), 0.0, 1e-12);  // the short way round
}

TEST(Trajectory, KnowsNothingOutsideTheRecording) {
  const Trajectory path({{1.0, {}}, {2.0, {}}});

  EXPECT_FALSE(path.at(0.999));
  EXPECT_TRUE(path.at(1.0));
  EXPECT_TRUE(path.at(2.0));
  EXPECT_FALSE(path.at(2.001));
}

TEST(RobotClock, ReadsAheadBySkewAndOffset) {
  const RobotClock clock{.offset_s = 1000.0, .skew_ppm = 20.0};

  EXPECT_EQ(to_ns(clock.local(50.0)), 1'050'001'000'000);
  EXPECT_NEAR(clock.true_s(clock.local(123.456)), 123.456, 1e-8);  // a nanosecond's rounding
}

TEST(SwarmTruth, GivesTheRelativePoseAtTheObserversOwnTime) {
  // Both drive along x at 1 m/s, the neighbor 3 m ahead; the observer looks along y.
  const std::map<RobotId, SwarmTruth::Robot> robots{
      {RobotId{1},
       {{.offset_s = 100.0, .skew_ppm = 0.0},
        Trajectory({{0.0, {Vector3d(0, 0, 0), about_z(std::numbers::pi / 2)}},
                    {10.0, {Vector3d(10, 0, 0), about_z(std::numbers::pi / 2)}}})}},
      {RobotId{2},
       {{.offset_s = -7.0, .skew_ppm = 0.0},
        Trajectory({{0.0, {Vector3d(3, 0, 0), about_z(0.0)}},
                    {10.0, {Vector3d(23, 0, 0), about_z(0.0)}}})}}};
  const SwarmTruth truth(robots);

  const Pose T_B_N =
      truth.relative(RobotId{1}, RobotId{2}, RobotClock{100.0, 0.0}.local(4.0)).value();

  EXPECT_NEAR((T_B_N.p - Vector3d(0, -7, 0)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(T_B_N.q.angularDistance(about_z(-std::numbers::pi / 2)), 0.0, 1e-9);
  EXPECT_FALSE(truth.relative(RobotId{1}, RobotId{2}, RobotClock{100.0, 0.0}.local(10.5)));
}

TEST(SwarmTruth, DistinguishesARightBearingFromAnothers) {
  Bearing bearing;
  bearing.p_B_C = {0.1, 0.0, 0.0};
  bearing.u_B = Vector3d(1, 1, 0).normalized();
  const Pose T_B_N{{1.1, 1.0, -0.2}, Eigen::Quaterniond::Identity()};

  EXPECT_NEAR(bearing_error_rad(bearing, T_B_N, {0.0, 0.0, 0.2}), 0.0, 1e-12);
  EXPECT_NEAR(bearing_error_rad(bearing, T_B_N, {0.0, -2.0, 0.2}), std::numbers::pi / 2, 1e-12);
}

TEST(Trajectory, NamesFileAndLineOfABadRow) {
  const TinySwarm files;
  files.write("truth/r1.csv", "# t\n0,0,0,0,1,0,0,0,0,0,0\n0.1,0,0,0,1,0,0,0,0,0,0\n");
  EXPECT_TRUE(Trajectory::load(files.dir() / "truth/r1.csv"));

  files.replace_line("truth/r1.csv", 3, "0.0,0,0,0,1,0,0,0,0,0,0");
  EXPECT_NE(Trajectory::load(files.dir() / "truth/r1.csv").error().message.find("r1.csv:3: time"),
            std::string::npos);

  files.replace_line("truth/r1.csv", 3, "0.1,0,0,0,2,0,0,0,0,0,0");
  EXPECT_NE(Trajectory::load(files.dir() / "truth/r1.csv").error().message.find("quaternion"),
            std::string::npos);
}

}  // namespace
}  // namespace crepes::truth_test
