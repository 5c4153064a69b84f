#include "daemon/ctl/view/live_messages.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "daemon/ctl/view/view_json.hpp"
#include "net/subscription/subscription_json.hpp"

namespace crepes::live_messages_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

constexpr Timestamp kStart{1000s};

NeighborPose pose_of(std::uint16_t id, Timestamp stamp) {
  NeighborPose pose;
  pose.neighbor = RobotId{id};
  pose.stamp = stamp;
  pose.mode = PoseMode::kGraph;
  pose.T_B_N.pose = {{1.0, -2.0, 3.0}, Eigen::Quaterniond::Identity()};
  pose.T_B_N.covariance = Eigen::Matrix<double, 6, 1>(1, 4, 9, 1, 1, 1).asDiagonal();
  pose.up_B = Eigen::Vector3d::UnitZ();
  return pose;
}

client::Answer answer_of(const std::string& text) {
  return {.message = client::parse(text).value(), .text = text};
}

client::Answer pose_answer(std::uint16_t id, Timestamp stamp) {
  return answer_of(pose_json(1, RobotId{1}, "r", pose_of(id, stamp)));
}

client::Answer status_answer() {
  SystemStatus status;
  status.self = RobotId{1};
  status.name = "r1";
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  status.estimator.neighbors = {neighbor};
  return answer_of(status_json(status));
}

/// The data of all events of this name, in order.
std::vector<Json> events_in(const std::string& text, const std::string& name) {
  std::vector<Json> found;
  const std::string head = "event: " + name + "\ndata: ";
  for (std::size_t at = text.find(head); at != std::string::npos; at = text.find(head, at + 1)) {
    const std::size_t begin = at + head.size();
    found.push_back(Json::parse(text.substr(begin, text.find("\n\n", begin) - begin)));
  }
  return found;
}

TEST(LiveMessages, KeepOnlyTheNewestPoseOfEachNeighborBetweenTwoPictures) {
  LiveMessages messages({});
  messages.add(pose_answer(2, kStart), kStart);
  messages.add(pose_answer(3, kStart), kStart);
  messages.add(pose_answer(2, kStart + 20ms), kStart);

  const auto frames = events_in(messages.drain(kStart), "frame");

  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0]["rows"].size(), 2U);
  EXPECT_EQ(frames[0]["rows"]["2"][0], 1000.02);
  EXPECT_EQ(frames[0]["up"], Json({0.0, 0.0, 1.0}));
  EXPECT_TRUE(events_in(messages.drain(kStart), "frame").empty());
}

TEST(LiveMessages, ReportADaemonThatFallsSilentAndOneThatAnswersAgain) {
  LiveMessages messages({});
  EXPECT_FALSE(events_in(messages.drain(kStart), "link").at(0)["ok"].get<bool>());

  messages.add(status_answer(), kStart);
  EXPECT_TRUE(events_in(messages.drain(kStart), "link").at(0)["ok"].get<bool>());
  EXPECT_TRUE(events_in(messages.drain(kStart + 1s), "link").empty());

  EXPECT_TRUE(events_in(messages.drain(kStart + 1500ms), "link").empty());
  const auto silent = events_in(messages.drain(kStart + 1501ms), "link");
  ASSERT_EQ(silent.size(), 1U);
  EXPECT_NE(silent[0]["reason"].get<std::string>().find("is crepesd running"), std::string::npos);
}

TEST(LiveMessages, GreetALatePageWithTheNewestStatus) {
  LiveMessages messages({});
  messages.add(status_answer(), kStart);
  (void)messages.drain(kStart);

  const auto statuses = events_in(messages.greeting(kStart), "status");

  ASSERT_EQ(statuses.size(), 1U);
  EXPECT_EQ(statuses[0]["name"], "r1");
  EXPECT_EQ(messages.robot(), (ViewedRobot{RobotId{1}, "r1"}));
  EXPECT_EQ(messages.neighbors(), std::vector<RobotId>{RobotId{2}});
}

TEST(LiveMessages, KnowTheNeighborsThatDidNotFitIntoADatagram) {
  LiveMessages messages({});
  messages.add(answer_of(R"({"class":"STATUS","self":1,"name":"r1","sensors":[],)"
                         R"("neighbors":[{"peer":2,"state":"none"}],"more":[3,5]})"),
               kStart);

  EXPECT_EQ(messages.neighbors(), (std::vector<RobotId>{RobotId{2}, RobotId{3}, RobotId{5}}));
}

TEST(LiveMessages, PutAStatusWithLineEndsIntoOneLine) {
  client::Answer answer = status_answer();
  answer.text.insert(1, "\n\nevent: frame\n");
  LiveMessages messages({});

  messages.add(answer, kStart);

  EXPECT_TRUE(events_in(messages.drain(kStart), "frame").empty());
}

TEST(ViewJson, WritesAPoseAsARowOfNumbers) {
  const Json row = Json::parse(pose_row(12.5, pose_of(2, kStart)));

  ASSERT_EQ(row.size(), 19U);
  EXPECT_EQ(row[0], 12.5);
  EXPECT_EQ(row[1], 1);     // graph
  EXPECT_EQ(row[3], -2.0);  // y
  EXPECT_EQ(row[5], 1.0);   // w
  EXPECT_EQ(row[14], 9.0);  // variance of z
  EXPECT_EQ(row[15], 3.0);  // largest sigma
}

TEST(ViewJson, LeavesOutWhatIsNotANumber) {
  NeighborPose pose = pose_of(2, kStart);
  pose.T_B_N.covariance(0, 0) = std::numeric_limits<double>::quiet_NaN();

  EXPECT_EQ(pose_row(0.0, pose), "");
}

}  // namespace
}  // namespace crepes::live_messages_test
