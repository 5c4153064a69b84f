#include "daemon/ctl/demo/steered_swarm.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <string>
#include <vector>

#include "daemon/ctl/demo/formation_score.hpp"
#include "drivers/base/scratch_directory.hpp"

namespace crepes::steered_swarm_test {
namespace {

TEST(VelocityCommand, IsReadAsItIsDocumented) {
  const auto command =
      parse_velocity_command(R"({"robot":2,"velocity":[0.5,-0.25,0.125],"turn_rate":0.75})")
          .value();

  EXPECT_EQ(command.robot, RobotId{2});
  EXPECT_EQ(command.v_L_B, Eigen::Vector3d(0.5, -0.25, 0.125));
  EXPECT_EQ(command.turn_rate_radps, 0.75);
}

TEST(VelocityCommand, IsRefusedWhereItIsNone) {
  for (const char* text :
       {"", "3", "{}", R"({"robot":0,"velocity":[0,0,0]})", R"({"robot":70000,"velocity":[0,0,0]})",
        R"({"robot":1,"velocity":[0,0]})", R"({"robot":1,"velocity":[0,0,1e999]})",
        R"({"robot":1,"velocity":[0,0,"fast"]})"})
    EXPECT_FALSE(parse_velocity_command(text)) << text;
  EXPECT_TRUE(rc::check([](const std::string& text) { (void)parse_velocity_command(text); }));
}

class Steered : public testing::Test {
 protected:
  void send(const std::string& text) {
    ASSERT_TRUE(sender_.send_to(std::vector<std::uint8_t>(text.begin(), text.end()),
                                Endpoint::parse("127.0.0.1", swarm_.port()).value()));
  }
  /// Runs as the demo does, a hundred times a second.
  void run(double from_s, double to_s, const std::string& command) {
    const auto turns = static_cast<int>(std::lround(100.0 * (to_s - from_s)));
    for (int i = 0; i < turns; ++i) {
      if (!command.empty()) send(command);
      ASSERT_TRUE(swarm_.run_until(from_s + 0.01 * i));
    }
  }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
  SimConfig sim_ = [this] {
    SimConfig sim;
    sim.scenario = SimScenario::kFormation;
    sim.track = scratch_.path() / "track";
    return sim;
  }();
  SteeredSwarm swarm_ = SteeredSwarm::open(sim_, 0).value();
  UdpSocket sender_ = UdpSocket::bind("127.0.0.1", 0).value();
};

TEST_F(Steered, FliesAsCommandedAndStopsWithoutCommands) {
  run(0.0, 4.0, R"({"robot":2,"velocity":[0.5,0,0]})");
  run(4.0, 8.0, "");
  const SimWorld world(sim_);
  SimConfig alone = sim_;
  alone.track.clear();
  const SimWorld unsteered(alone);

  // The robot's own swaying apart.
  const auto v_L = [&](double t_s) -> Eigen::Vector3d {
    return unsteered.T_W_B(RobotId{2}, t_s).q.conjugate() *
           (world.state(RobotId{2}, t_s).v_W_B - unsteered.state(RobotId{2}, t_s).v_W_B);
  };
  EXPECT_NEAR(v_L(3.9).x(), 0.5, 0.02);  // the swaying turns it by some degrees
  EXPECT_LT(v_L(7.5).norm(), 0.01);
  EXPECT_EQ(swarm_.late(), 1U);  // the one that begins with the world itself
  EXPECT_EQ(swarm_.received(), 400U);
}

TEST_F(Steered, LimitsSpeedAndRefusesWhatIsNoCommand) {
  run(0.0, 4.0, R"({"robot":3,"velocity":[0,0,9],"turn_rate":-50})");
  run(4.0, 4.02, R"({"robot":9,"velocity":[0,0,0]})");
  run(4.02, 4.04, "hover!");

  const SimWorld world(sim_);
  EXPECT_NEAR(world.state(RobotId{3}, 3.9).v_W_B.z(), 1.0, 0.1);
  EXPECT_NEAR(world.state(RobotId{3}, 3.9).w_W_B_B.z(), -1.0, 0.1);
  EXPECT_EQ(swarm_.refused(), 4U);
}

TEST_F(Steered, DoesNotChangeThePastWhenItIsLate) {
  run(0.0, 1.0, R"({"robot":2,"velocity":[0.5,0,0]})");
  const SimWorld world(sim_);
  const Pose seen = world.T_W_B(RobotId{2}, 1.95);  // what a daemon saw meanwhile

  send(R"({"robot":2,"velocity":[-0.5,0,0]})");
  ASSERT_TRUE(swarm_.run_until(2.0));

  EXPECT_GT(swarm_.late(), 40U);
  EXPECT_LT((world.T_W_B(RobotId{2}, 1.95).p - seen.p).norm(), 1e-9);
}

TEST(FormationScore, MeasuresFromTheLeader) {
  SimConfig sim;
  sim.scenario = SimScenario::kFormation;
  double some = 0.0;
  for (sim.seed = 1; sim.seed <= 20; ++sim.seed) {
    const FormationScore score = score_formation(SimWorld(sim), 0.0, 20.0);
    EXPECT_LE(score.rms_m, score.max_m);
    some = std::max(some, score.rms_m);
  }
  // Followers begin up to 0.4 m from their places on each axis; all may be turned by 3 deg.
  EXPECT_GT(some, 0.3);
  EXPECT_LT(some, 1.5);
  EXPECT_NEAR(formation_place(RobotId{2}).norm(), kFormationSide, 1e-12);
  EXPECT_NEAR((formation_place(RobotId{2}) - formation_place(RobotId{3})).norm(), kFormationSide,
              1e-12);
}

}  // namespace
}  // namespace crepes::steered_swarm_test
