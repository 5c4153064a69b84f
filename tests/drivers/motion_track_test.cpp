#include "drivers/sim/motion_track.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "drivers/sim/world.hpp"

namespace crepes::motion_track_test {
namespace {

class MotionTrack : public testing::Test {
 protected:
  ~MotionTrack() override { std::filesystem::remove(file_); }

  std::string file_ = testing::TempDir() + "motion_track_" +
                      testing::UnitTest::GetInstance()->current_test_info()->name();
};

SteeredState at_x(double begin_s, double x, double command) {
  SteeredState state;
  state.x.begin_s = begin_s;
  state.x.position = x;
  state.x.command = command;
  return state;
}

TEST_F(MotionTrack, IsReadWhileItIsWritten) {
  auto writer = MotionTrackWriter::create(file_, 2).value();
  const auto reader = MotionTrackReader::open(file_, 2).value();
  EXPECT_FALSE(reader.at(0, 0.0));

  ASSERT_TRUE(writer.append({at_x(0.0, 1.0, 0.0), at_x(0.0, 2.0, 0.0)}));
  ASSERT_TRUE(writer.append({at_x(0.02, 3.0, 0.0), at_x(0.02, 4.0, 0.0)}));

  EXPECT_EQ(reader.at(1, 0.019)->x.position, 2.0);
  EXPECT_EQ(reader.at(0, 0.02)->x.position, 3.0);
  EXPECT_EQ(reader.at(0, -1.0)->x.position, 1.0);
  EXPECT_EQ(reader.at(1, 7.0)->x.position, 4.0);  // the last command holds
  EXPECT_DOUBLE_EQ(writer.next_s(), 0.04);
}

TEST_F(MotionTrack, FindsTheRecordOfEveryInstantAtWhichOneBegins) {
  auto writer = MotionTrackWriter::create(file_, 1).value();
  std::vector<double> begins;
  for (int i = 0; i < 5000; ++i) {
    begins.push_back(writer.next_s());
    ASSERT_TRUE(writer.append({at_x(writer.next_s(), i, 0.0)}));
  }
  const auto reader = MotionTrackReader::open(file_, 1).value();

  for (std::size_t i = 0; i < begins.size(); ++i)
    EXPECT_EQ(reader.at(0, begins[i])->x.position, static_cast<double>(i));
}

TEST_F(MotionTrack, NamesAFileThatIsNotThere) {
  const auto reader = MotionTrackReader::open("/nowhere/track", 1);

  ASSERT_FALSE(reader);
  EXPECT_NE(reader.error().message.find("/nowhere/track"), std::string::npos);
}

TEST_F(MotionTrack, MovesTheRobotsOfAWorldSmoothly) {
  SimConfig config;
  config.scenario = SimScenario::kFormation;
  config.track = file_;
  auto writer = MotionTrackWriter::create(file_, 3).value();
  std::vector<SteeredState> robots(3);
  for (int i = 0; i < 150; ++i) {
    const double t_s = writer.next_s();
    const double command = i % 40 < 20 ? 0.5 : -0.3;
    robots[1].x = robots[1].x.after(t_s, command);
    robots[1].yaw = robots[1].yaw.after(t_s, 0.5 * command);
    ASSERT_TRUE(writer.append(robots));
  }
  const SimWorld world(config);
  ASSERT_EQ(world.fault(), "");

  constexpr double kStep = 1e-4;
  double fastest = 0.0;
  for (double t = 0.105; t < 3.2; t += 0.0137) {
    const BodyState state = world.state(RobotId{2}, t);
    const BodyState before = world.state(RobotId{2}, t - kStep);
    const BodyState after = world.state(RobotId{2}, t + kStep);
    const Eigen::Vector3d v = (after.T_W_B.p - before.T_W_B.p) / (2 * kStep);
    const Eigen::Vector3d a = (after.v_W_B - before.v_W_B) / (2 * kStep);
    const Eigen::Vector3d w = so3_log(before.T_W_B.q.conjugate() * after.T_W_B.q) / (2 * kStep);
    EXPECT_LT((v - state.v_W_B).norm(), 1e-6) << t;
    EXPECT_LT((a - state.a_W_B).norm(), 1e-3) << t;  // its slope jumps with the command
    EXPECT_LT((w - state.w_W_B_B).norm(), 1e-3) << t;
    fastest = std::max(fastest, state.v_W_B.norm());
  }
  EXPECT_GT(fastest, 0.2);
}

TEST_F(MotionTrack, AWorldWithoutItsTrackSaysSo) {
  SimConfig config;
  config.scenario = SimScenario::kFormation;
  config.track = "/nowhere/track";

  EXPECT_NE(SimWorld(config).fault().find("/nowhere/track"), std::string::npos);
}

}  // namespace
}  // namespace crepes::motion_track_test
