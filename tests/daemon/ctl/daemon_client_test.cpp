#include "net/client/daemon_client.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/demo/child_process.hpp"
#include "daemon/ctl/demo/demo_swarm.hpp"
#include "daemon/ctl/demo/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "net/subscription/subscription_json.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

NeighborPose a_pose() {
  NeighborPose pose;
  pose.neighbor = RobotId{3};
  pose.stamp = Timestamp{Duration{1'234'567'890'123'456'789}};
  pose.mode = PoseMode::kGraph;
  pose.T_B_N.pose = {{1.0, -2.0, 3.0}, Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5)};
  pose.T_B_N.covariance = Eigen::Matrix<double, 6, 1>(1, 2, 3, 4, 5, 6).asDiagonal();
  pose.T_B_N.covariance(0, 5) = pose.T_B_N.covariance(5, 0) = 0.5;
  pose.age_s = 0.25;
  pose.up_B = Eigen::Vector3d(0.6, 0.0, 0.8);
  return pose;
}

TEST(DaemonMessages, ReadWhatTheDaemonWrites) {
  const DaemonMessage message = parse_message(pose_json(7, RobotId{1}, "r3", a_pose())).value();

  const auto& pose = std::get<PoseMessage>(message);
  EXPECT_EQ(pose.self, RobotId{1});
  EXPECT_EQ(pose.name, "r3");
  EXPECT_EQ(pose.pose.neighbor, RobotId{3});
  EXPECT_EQ(pose.pose.stamp, a_pose().stamp);  // to the nanosecond, although JSON has doubles
  EXPECT_EQ(pose.pose.mode, PoseMode::kGraph);
  EXPECT_EQ(pose.pose.T_B_N.pose.p, a_pose().T_B_N.pose.p);
  EXPECT_NEAR(pose.pose.T_B_N.pose.q.angularDistance(a_pose().T_B_N.pose.q), 0.0, 1e-7);
  EXPECT_EQ(pose.pose.T_B_N.covariance, a_pose().T_B_N.covariance);
  EXPECT_EQ(pose.pose.age_s, 0.25);
  EXPECT_EQ(pose.pose.up_B, a_pose().up_B);
}

TEST(DaemonMessages, ReadTheReasonWhereThereIsNoPose) {
  SystemStatus status;
  status.self = RobotId{1};
  status.name = "r1";
  status.sensors = {{.name = "imu",
                     .rate_hz = 99.5,
                     .ok = false,
                     .message = "unplugged",
                     .totals = {.faults = {{"stuck", 3}}, .counts = {{"samples", 500}}}}};
  status.clocks = {{.peer = RobotId{2}, .offset_s = -17.5, .skew_ppm = 3.0, .sigma_s = 1e-4}};
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  neighbor.name = "r2";
  neighbor.reason = NoPoseReason::kNoRange;
  status.estimator.neighbors = {neighbor};

  const auto read = std::get<StatusMessage>(parse_message(status_json(status)).value());

  ASSERT_EQ(read.neighbors.size(), 1U);
  EXPECT_EQ(read.neighbors[0].reason, "no range");
  EXPECT_EQ(read.neighbors[0].state, "none");
  ASSERT_EQ(read.sensors.size(), 1U);
  EXPECT_EQ(read.sensors[0].message, "unplugged");
  EXPECT_FALSE(read.sensors[0].ok);
  EXPECT_EQ(read.sensors[0].faults, (StatusMessage::Totals{{"stuck", 3}}));
  EXPECT_EQ(read.sensors[0].counts, (StatusMessage::Totals{{"samples", 500}}));
  ASSERT_EQ(read.clocks.size(), 1U);
  EXPECT_EQ(read.clocks[0].offset_s, -17.5);
}

TEST(DaemonMessages, ReadAllAboutOneNeighbor) {
  SystemStatus status;
  status.stamp = Timestamp{100s};
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  neighbor.measurements[0][0] = 17;
  neighbor.newest[0] = Timestamp{99s};
  status.estimator.neighbors = {neighbor};
  status.traffic = {{.peer = RobotId{2}, .received = 70, .lost = 3, .restarts = 1, .age_s = 0.02}};

  const auto read =
      std::get<StatusMessage>(parse_message(peer_status_json(status, RobotId{2}).value()).value());

  EXPECT_EQ(read.neighbors.at(0).measurements.at("bearing").at("fused"), 17U);
  EXPECT_EQ(read.neighbors.at(0).ages_s.at("bearing"), 1.0);
  EXPECT_EQ(read.neighbors.at(0).reports.value().lost, 3U);
}

TEST(DaemonMessages, RefuseWhatTheyCannotRead) {
  for (const char* text :
       {"", "{", "[]", "3", R"({"class":"HELLO"})", R"({"class":7})", R"({"class":"POSE"})",
        R"({"class":"POSE","self":1,"peer":2,"t_ns":"soon","position":{"x":0,"y":0,"z":0},)"
        R"("orientation":{"w":1,"x":0,"y":0,"z":0}})",
        R"({"class":"STATUS","self":1,"neighbors":[{"name":"nobody"}]})"})
    EXPECT_FALSE(parse_message(text)) << text;
}

TEST(DaemonMessages, SurviveAnyBytes) {
  EXPECT_TRUE(rc::check([](const std::string& bytes) { (void)parse_message(bytes); }));
}

TEST(DaemonClient, TalksToWhoeverIsAtItsPortAndNobodyElse) {
  auto daemon = UdpSocket::bind("127.0.0.1", 0).value();
  auto stranger = UdpSocket::bind("127.0.0.1", 0).value();
  auto client = DaemonClient::open("127.0.0.1", daemon.local().port).value();
  const auto bytes = [](const std::string& text) {
    return std::vector<std::uint8_t>(text.begin(), text.end());
  };

  ASSERT_TRUE(client.poll());
  const std::optional<Datagram> request = daemon.receive(1000ms).value();

  ASSERT_TRUE(request);
  const std::string text(request->bytes.begin(), request->bytes.end());
  EXPECT_TRUE(std::holds_alternative<PollRequest>(parse_request(text).value().what));
  ASSERT_TRUE(stranger.send_to(bytes(error_json("not me")), request->from));
  EXPECT_FALSE(client.receive(1000ms).value());
  ASSERT_TRUE(daemon.send_to(bytes("garbage"), request->from));
  EXPECT_FALSE(client.receive(1000ms).value());
  EXPECT_EQ(client.malformed(), 1U);
  ASSERT_TRUE(daemon.send_to(bytes(error_json("busy")), request->from));
  const auto answer = client.receive(1000ms).value();
  ASSERT_TRUE(answer);
  EXPECT_EQ(std::get<ErrorMessage>(answer->message).message, "busy");
}

TEST(DaemonClient, EchoesTheCookieThatItsDaemonWants) {
  auto daemon = UdpSocket::bind("127.0.0.1", 0).value();
  auto client = DaemonClient::open("127.0.0.1", daemon.local().port).value();
  const auto next_request = [&] {
    const Datagram datagram = daemon.receive(10'000ms).value().value();
    return std::pair{datagram.from, std::string(datagram.bytes.begin(), datagram.bytes.end())};
  };
  ASSERT_TRUE(client.watch());
  ASSERT_TRUE(client.poll(RobotId{3}));
  const auto [from, first] = next_request();
  (void)next_request();
  const std::string wanted = cookie_json("0123456789abcdef");
  EXPECT_GE(first.size(), wanted.size());

  ASSERT_TRUE(daemon.send_to(std::vector<std::uint8_t>(wanted.begin(), wanted.end()), from));
  EXPECT_FALSE(client.receive(10'000ms).value());

  const SubscriptionRequest watch = parse_request(next_request().second).value();
  const SubscriptionRequest poll = parse_request(next_request().second).value();
  EXPECT_EQ(watch.cookie, "0123456789abcdef");
  EXPECT_TRUE(std::get<WatchRequest>(watch.what).enable);
  EXPECT_EQ(poll.cookie, "0123456789abcdef");
  EXPECT_EQ(std::get<PollRequest>(poll.what).peer, RobotId{3});
}

TEST(DaemonClient, RefusesAnAddressThatIsNone) {
  EXPECT_EQ(DaemonClient::open("localhost:1", 1).error().code, ErrorCode::kUsage);
}

TEST(ChildProcess, TellsHowItEndedAndKeepsItsOutput) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto log = scratch.path() / "log";
  {
    auto child = ChildProcess::start("/bin/sh", {"-c", "echo said; exit 3"}, log).value();
    while (!child.exit_reason()) {
    }
    EXPECT_EQ(child.exit_reason(), "exit code 3");
  }
  EXPECT_EQ(read_text_file(log).value(), "said\n");
}

TEST(ChildProcess, EndsWithItsOwner) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto log = scratch.path() / "log";
  auto child = std::make_optional(
      ChildProcess::start("/bin/sh", {"-c", "echo $$; exec sleep 100"}, log).value());
  std::string pid;
  while (pid.empty()) pid = read_text_file(log).value_or("");
  pid.pop_back();
  ASSERT_TRUE(std::filesystem::exists("/proc/" + pid));

  child.reset();

  EXPECT_FALSE(std::filesystem::exists("/proc/" + pid));
}

TEST(ChildProcess, NamesAProgramThatIsNotThere) {
  const auto child = ChildProcess::start("/nowhere/crepesd", {}, "/dev/null");

  ASSERT_FALSE(child);
  EXPECT_NE(child.error().message.find("/nowhere/crepesd"), std::string::npos);
}

TEST(DemoSwarm, GivesEveryRobotAValidConfiguration) {
  const std::vector<RobotId> ids{RobotId{1}, RobotId{2}, RobotId{3}, RobotId{4}, RobotId{5}};

  for (const DemoRobot& robot : demo_swarm({}, ids, 12345.5, 47481, 50000)) {
    const CheckedConfig read = check_config_text(write_config(robot.config), "demo.yaml");

    EXPECT_TRUE(read.faults.empty()) << to_string(read.faults.front());
    EXPECT_EQ(read.config.sim.clock_offset_s, robot.clock.offset_s);
    EXPECT_EQ(read.config.sim.epoch_s, 12345.5);
  }
}

}  // namespace
}  // namespace crepes
