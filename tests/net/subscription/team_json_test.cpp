#include "net/subscription/team_json.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "estimator/core/constants.hpp"
#include "net/client/client.hpp"
#include "net/subscription/subscription_json.hpp"
#include "tests/support/places.hpp"

namespace crepes::team_json_test {
namespace {

using Json = nlohmann::json;

constexpr RobotId kSelf{1};
constexpr RobotId kOther{3};

/// A robot whose camera is turned by 0.4 deg about z, with as many cameras.
TeamRobotStatus robot_with(RobotId id, int cameras) {
  TeamRobotStatus robot;
  robot.calibration.robot = id;
  robot.calibration.is_trusted = true;
  robot.calibration.imu.gyro_radps = {-0.0012345678, 0.0023456789, -0.0034567891};
  robot.calibration.imu.gyro_sigma_radps = Eigen::Vector3d::Constant(0.000123456);
  robot.calibration.imu.accel_mps2 = {-0.12345678, 0.023456789, -0.034567891};
  robot.calibration.imu.accel_sigma_mps2 = Eigen::Vector3d::Constant(0.0123456);
  robot.calibration.imu.gyro_scale = -0.00123456 * Eigen::Matrix3d::Identity();
  robot.calibration.imu.gyro_scale_sigma = Eigen::Matrix3d::Constant(0.00123456);
  robot.calibration.antenna_delay_m = 0.0312345;
  robot.calibration.antenna_delay_sigma_m = 0.0123456;
  robot.calibration.clock_s = 0.0012341;
  robot.calibration.clock_sigma_s = 0.00023456;
  for (int i = 0; i < cameras; ++i) {
    robot.calibration.cameras.push_back(
        {.p_B_C = {0.1234567, -0.0234567, 0.1 * i},
         .rotation = radians(0.4) * Eigen::Vector3d::UnitZ(),
         .covariance = std::pow(radians(0.05), 2) * Eigen::Matrix3d::Identity(),
         .lens = {-0.00023456, 0.00034567, 0.0},
         .lens_sigma = Eigen::Vector3d::Constant(0.00043456),
         .state = CameraMisalignment::State::kTurned});
  }
  robot.residuals = {ResidualStatus{.nis = 0.81234, .fused = 1234567, .refused = 54321},
                     ResidualStatus{.nis = 1.05432, .fused = 123456, .refused = 4321},
                     ResidualStatus{.nis = 0.91234, .fused = 12345, .refused = 321}};
  robot.faults = {{id, TeamFault::Kind::kCameraTurned, radians(0.4), radians(0.05)}};
  return robot;
}

SystemStatus team_of(int robots, int cameras) {
  SystemStatus status;
  status.self = kSelf;
  status.name = "r1";
  status.stamp = Timestamp{std::chrono::seconds{100}};
  TeamStatus team{.stamp = status.stamp - std::chrono::milliseconds{120}, .robots = {}};
  for (int i = 1; i <= robots; ++i) {
    const RobotId id{static_cast<std::uint16_t>(i)};
    team.robots.push_back(robot_with(id, cameras));
    if (id == kSelf) continue;
    NeighborStatus neighbor;
    neighbor.neighbor = id;
    neighbor.name = "r" + std::to_string(i);
    for (auto& kind : neighbor.measurements) kind.fill(123456);
    neighbor.nis.fill(1.23456);
    neighbor.calibration.emplace();
    neighbor.calibration->value.fill(-0.0123456789);
    neighbor.calibration->sigma.fill(0.00123456789);
    status.estimator.neighbors.push_back(std::move(neighbor));
  }
  status.estimator.team = std::move(team);
  return status;
}

TEST(TeamJson, ListsTheRobotsOfTheTeam) {
  const Json json = Json::parse(team_status_json(team_of(4, 2)));
  EXPECT_EQ(json["team"]["age_s"], 0.12);
  ASSERT_EQ(json["team"]["robots"].size(), 4U);
  EXPECT_EQ(json["team"]["robots"][0]["name"], "r1");
  EXPECT_EQ(json["team"]["robots"][2]["robot"], 3);
  EXPECT_EQ(json["team"]["robots"][2]["trusted"], true);
  EXPECT_EQ(json["team"]["robots"][2]["nis"],
            Json({{"bearing", 0.812}, {"range", 1.05}, {"gyro", 0.912}}));
  EXPECT_FALSE(json["team"]["robots"][2].contains("calibration"));
  EXPECT_FALSE(json.contains("truncated"));
}

TEST(TeamJson, ReportsOneRobotInFull) {
  const Json json = Json::parse(team_status_json(team_of(4, 1), kOther).value());
  ASSERT_EQ(json["team"]["robots"].size(), 1U);
  const Json& robot = json["team"]["robots"][0];
  EXPECT_EQ(robot["residuals"]["bearing"],
            Json({{"nis", 0.812}, {"fused", 1234567}, {"refused", 54321}}));
  EXPECT_EQ(robot["calibration"]["antenna_delay_m"], Json({{"value", 0.03123}, {"sigma", 0.012}}));
  EXPECT_EQ(robot["calibration"]["clock_ms"], Json({{"value", 1.234}, {"sigma", 0.23}}));
  EXPECT_EQ(robot["calibration"]["gyro_bias_radps"]["value"][1], 0.002346);
  const Json& camera = robot["calibration"]["cameras"][0];
  EXPECT_EQ(camera["turned_deg"], Json({{"value", 0.4}, {"sigma", 0.05}}));
  EXPECT_EQ(camera["misalignment_deg"]["value"], Json({0.0, 0.0, 0.4}));
  EXPECT_EQ(camera["lens_mrad"]["value"], Json({-0.2346, 0.3457, 0.0}));
  EXPECT_EQ(camera["lens_mrad"]["sigma"], Json({0.43, 0.43, 0.43}));
  EXPECT_EQ(camera["state"], "turned");
  EXPECT_EQ(robot["faults"][0],
            "its camera is turned by 0.40 +- 0.05 deg against its calibration; calibrate it again");
}

TEST(TeamJson, ThisRobotsClockIsWhatOthersErrFrom) {
  const Json json = Json::parse(team_status_json(team_of(4, 1), kSelf).value());
  EXPECT_FALSE(json["team"]["robots"][0]["calibration"].contains("clock_ms"));
}

TEST(TeamJson, ReportsAPairsFilter) {
  const std::string text = pair_status_json(team_of(4, 1), kOther).value();
  EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
  const Json pair = Json::parse(text)["pair"];
  EXPECT_EQ(pair["peer"], 3);
  EXPECT_EQ(pair["residuals"]["peer_range"],
            Json({{"nis", 1.23}, {"fused", 123456}, {"refused", 5 * 123456}}));
  EXPECT_EQ(pair["calibration"]["range_bias_m"], Json({{"value", -0.01235}, {"sigma", 0.0012}}));
  EXPECT_EQ(pair["calibration"]["own_misalignment_deg"]["value"][2], -0.7074);
  EXPECT_FALSE(pair_status_json(team_of(4, 1), RobotId{9}));
}

TEST(TeamJson, ShortensAPairsFilterThatDoesNotFit) {
  SystemStatus status = team_of(4, 1);
  status.self = RobotId{60001};
  status.name = std::string(32, 'a');
  status.uptime_s = 86400.1234;
  NeighborStatus& neighbor = status.estimator.neighbors.front();
  neighbor.neighbor = RobotId{60002};
  neighbor.name = std::string(32, 'b');
  for (auto& kind : neighbor.measurements) kind.fill(123456789012);
  neighbor.calibration->value.fill(-1.2345678e-5);
  neighbor.calibration->sigma.fill(1.2345678e-5);

  const std::string text = pair_status_json(status, neighbor.neighbor).value();

  EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
  const Json json = Json::parse(text);
  EXPECT_EQ(json["truncated"], true);
  EXPECT_EQ(json["pair"]["peer"], 60002);
  EXPECT_TRUE(json["pair"]["calibration"].contains("range_bias_m"));
  EXPECT_FALSE(Json::parse(pair_status_json(team_of(4, 1), kOther).value()).contains("truncated"));
}

TEST(TeamJson, FitsADatagramHoweverLargeTheTeam) {
  for (const int robots : {1, 4, 12, 50}) {
    const std::string text = team_status_json(team_of(robots, 4));
    EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
    const Json json = Json::parse(text);
    EXPECT_EQ(json["team"]["robots"].size() + json.value("more", Json::array()).size(),
              static_cast<std::size_t>(robots));
    EXPECT_EQ(json.contains("truncated"), json.contains("more"));
  }
  for (const int cameras : {0, 1, 2, 3, 4}) {
    SystemStatus status = team_of(4, cameras);
    const std::string text = team_status_json(status, kOther).value();
    EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
    const Json json = Json::parse(text);
    EXPECT_EQ(json.contains("truncated"), cameras > 1) << cameras << " cameras";
    const Json& listed = json["team"]["robots"][0]["calibration"]["cameras"];
    EXPECT_GE(listed.size(), std::min<std::size_t>(cameras, 2));
    for (const Json& camera : listed) EXPECT_EQ(camera.contains("lens_mrad"), cameras == 1);
    for (TeamRobotStatus& robot : status.estimator.team->robots)
      robot.faults.resize(40, robot.faults.front());
    EXPECT_LE(team_status_json(status, kOther)->size(), kMaxSubscriptionDatagram);
    EXPECT_LE(team_status_json(status).size(), kMaxSubscriptionDatagram);
  }
}

TEST(TeamJson, LeavesOutWhatIsNotKnown) {
  SystemStatus status = team_of(4, 1);
  EXPECT_FALSE(team_status_json(status, RobotId{9}));
  status.estimator.team->robots[2].calibration.antenna_delay_m =
      std::numeric_limits<double>::quiet_NaN();
  status.estimator.team->robots[2].residuals = {};
  const std::string text = team_status_json(status, kOther).value();
  EXPECT_EQ(text.find("null"), std::string::npos);
  EXPECT_EQ(text.find("antenna_delay_m"), std::string::npos);
  EXPECT_EQ(text.find("residuals"), std::string::npos);
  status.estimator.team.reset();
  EXPECT_EQ(Json::parse(team_status_json(status))["team"], Json::object());
  EXPECT_EQ(Json::parse(team_status_json(status, kOther).value())["team"], Json::object());
}

TEST(TeamJson, TheClientLibraryReadsIt) {
  const auto message = client::parse(team_status_json(team_of(4, 2), kOther).value());
  ASSERT_TRUE(message);
  const auto& status = std::get<client::Status>(*message);
  ASSERT_TRUE(status.team);
  EXPECT_EQ(status.team->age_s, 0.12);
  const auto& robot = status.team->robots.at(0);
  EXPECT_EQ(robot.robot, 3);
  EXPECT_TRUE(robot.trusted);
  EXPECT_EQ(robot.nis.at("range"), 1.05);
  EXPECT_EQ(robot.residuals.at("gyro").fused, 12345U);
  EXPECT_EQ(robot.calibration.at("antenna_delay_m").sigma, std::vector{0.012});
  EXPECT_EQ(robot.calibration.at("accel_bias_mps2").value.size(), 3U);
  ASSERT_EQ(robot.cameras.size(), 2U);
  EXPECT_EQ(robot.cameras[1].state, "turned");
  EXPECT_EQ(robot.cameras[1].estimates.at("turned_deg").value, std::vector{0.4});
  EXPECT_EQ(robot.faults.size(), 1U);

  const auto pair = client::parse(pair_status_json(team_of(4, 2), kOther).value());
  ASSERT_TRUE(pair && std::get<client::Status>(*pair).pair);
  EXPECT_EQ(std::get<client::Status>(*pair).pair->peer, 3);
  EXPECT_EQ(std::get<client::Status>(*pair).pair->residuals.at("range").nis, 1.23);
  EXPECT_EQ(std::get<client::Status>(*pair).pair->calibration.size(), 7U);
}

void add_keys(const Json& json, std::set<std::string>& keys) {
  for (const auto& [key, value] : json.items()) {
    if (!json.is_array()) keys.insert(key);
    if (value.is_structured()) add_keys(value, keys);
  }
}

TEST(TeamJson, HasOnlyDocumentedKeys) {
  std::ifstream file(std::string(source_dir()) + "/config/docs/formats.md");
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  std::set<std::string> keys;
  for (const int cameras : {1, 2})
    add_keys(Json::parse(team_status_json(team_of(4, cameras), kOther).value()), keys);
  add_keys(Json::parse(pair_status_json(team_of(4, 2), kOther).value()), keys);
  EXPECT_GT(keys.size(), 25U);
  for (const std::string& key : keys)
    EXPECT_NE(document.find('`' + key + '`'), std::string::npos) << key;
}

}  // namespace
}  // namespace crepes::team_json_test
