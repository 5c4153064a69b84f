#include "net/subscription/pose_push.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <regex>

#include "drivers/base/text_file.hpp"
#include "net/subscription/subscription_json.hpp"
#include "tests/support/places.hpp"

namespace crepes::pose_push_test {
namespace {

using Json = nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};

NeighborPose pose_of(int id, Timestamp stamp = kStart) {
  NeighborPose pose;
  pose.neighbor = RobotId{static_cast<std::uint16_t>(id)};
  pose.stamp = stamp;
  pose.mode = PoseMode::kGraph;
  pose.T_B_N.pose = {{1.0 * id, -2.0 / 3, 0.5}, so3_exp({0.0, 0.0, 0.3})};
  pose.T_B_N.covariance = 0.04 * Matrix6d::Identity();
  pose.v_B_N = {0.1, 0.2, 0.3};
  return pose;
}

std::vector<NeighborPose> poses_of(int neighbors) {
  std::vector<NeighborPose> poses;
  for (int id = 2; id < neighbors + 2; ++id) poses.push_back(pose_of(id));
  return poses;
}

TEST(PlotJson, PutsNeighborsUnderTheirIdsBesideOneTimestamp) {
  const auto datagrams = plot_json({pose_of(2), pose_of(3)});

  ASSERT_EQ(datagrams.size(), 1U);
  const Json json = Json::parse(datagrams[0]);
  EXPECT_NEAR(json["timestamp"].get<double>(), 1000.0, 1e-9);
  EXPECT_EQ(json["3"]["x"], 3.0);
  EXPECT_NEAR(json["2"]["yaw"].get<double>(), 0.3, 1e-6);
  EXPECT_NEAR(json["2"]["roll"].get<double>(), 0.0, 1e-6);
  EXPECT_NEAR(json["2"]["qw"].get<double>(), std::cos(0.15), 1e-6);
  EXPECT_EQ(json["2"]["vz"], 0.3);
  EXPECT_NEAR(json["2"]["sigma_m"].get<double>(), 0.2, 1e-9);
  EXPECT_EQ(json["2"]["mode"], 1);
}

TEST(PlotJson, HoldsNumbersAlone) {
  NeighborPose pose = pose_of(2);
  pose.v_B_N.x() = std::numeric_limits<double>::quiet_NaN();
  const Json json = Json::parse(plot_json({pose}).at(0));

  for (const auto& [key, value] : json["2"].items()) EXPECT_TRUE(value.is_number()) << key;
  EXPECT_FALSE(json["2"].contains("vx"));
  EXPECT_TRUE(json["timestamp"].is_number());
}

TEST(PlotJson, HasWhatTheExampleLayoutDraws) {
  const std::string layout =
      read_text_file(source_dir() + "/config/examples/plotjuggler/crepes.xml").value();
  const Json sent = Json::parse(plot_json(poses_of(3)).at(0));
  const std::regex curve(R"re(<curve name="/(\d+)/(\w+)")re");

  const std::sregex_iterator begin(layout.begin(), layout.end(), curve);
  EXPECT_EQ(std::distance(begin, std::sregex_iterator()), 30);
  std::for_each(begin, std::sregex_iterator(), [&](const std::smatch& found) {
    EXPECT_TRUE(sent.contains(found[1]) && sent[found[1].str()].contains(found[2])) << found.str();
  });
}

TEST(PlotJson, DistributesManyNeighborsOverWholeDatagrams) {
  std::size_t neighbors = 0;
  for (const std::string& text : plot_json(poses_of(30))) {
    EXPECT_LE(text.size(), kMaxSubscriptionDatagram);
    const Json json = Json::parse(text);
    EXPECT_NEAR(json["timestamp"].get<double>(), 1000.0, 1e-9);
    neighbors += json.size() - 1;
  }
  EXPECT_EQ(neighbors, 30U);
}

TEST(PlotJson, NeverMixesStamps) {
  const auto datagrams = plot_json({pose_of(2), pose_of(3, kStart + milliseconds{20}), pose_of(2)});

  ASSERT_EQ(datagrams.size(), 3U);
  EXPECT_NEAR(Json::parse(datagrams[1])["timestamp"].get<double>(), 1000.02, 1e-9);
}

TEST(PlotJson, IsEmptyWithoutPoses) { EXPECT_TRUE(plot_json({}).empty()); }

TEST(PosePush, KeepsToItsRate) {
  PosePush push({.address = "127.0.0.1", .port = 9870, .rate_hz = 10.0, .format = {}}, RobotId{1},
                {});
  std::size_t datagrams = 0;
  for (int i = 0; i < 500; ++i)
    datagrams += push.datagrams({pose_of(2, kStart + milliseconds{20 * i})}).size();

  EXPECT_NEAR(static_cast<double>(datagrams), 100.0, 1.0);
}

TEST(PosePush, SendsTheSamePosesAsToSubscribers) {
  PosePush push({.address = "::1", .port = 5000, .rate_hz = 50.0, .format = PushFormat::kJson},
                RobotId{1}, {{RobotId{2}, "r2"}, {RobotId{3}, "r3"}});

  const auto datagrams = push.datagrams({pose_of(2), pose_of(3)});

  ASSERT_EQ(datagrams.size(), 2U);
  EXPECT_EQ(datagrams[1], pose_json(1, RobotId{1}, "r3", pose_of(3)));
  EXPECT_EQ(push.target().to_string(), "[::1]:5000");
}

}  // namespace
}  // namespace crepes::pose_push_test
