#include "daemon/stages/subscription_server.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "daemon/service/logging.hpp"

namespace crepes::subscription_server_test {
namespace {

using std::chrono::seconds;

class SubscriptionServerTest : public testing::Test {
 protected:
  static SubscriptionConfig pushing_to(const std::string& address) {
    SubscriptionConfig config;
    config.listen.clear();
    config.push = {{.address = address, .port = 9}};
    return config;
  }
  void publish(Timestamp now) {
    NeighborPose pose;
    pose.neighbor = RobotId{2};
    pose.stamp = now;
    server_.publish({pose}, now);
    server_.open_missing();
  }
  [[nodiscard]] std::uint64_t total(const std::string& name) const {
    const auto counters = server_.counters();
    const auto found =
        std::ranges::find(counters, name, [](const auto& each) { return each.first; });
    return found == counters.end() ? 0 : found->second;
  }

  LogSession log_{LogLevel::kError};
  std::map<RobotId, std::string> names_{{RobotId{1}, "r1"}, {RobotId{2}, "r2"}};
  // The system refuses to send there without SO_BROADCAST.
  SubscriptionServer server_{RobotId{1}, names_, pushing_to("255.255.255.255"),
                             [] { return SystemStatus{}; }};
};

TEST_F(SubscriptionServerTest, SaysWhyPosesCannotBePushed) {
  publish(Timestamp{seconds{1}});

  EXPECT_EQ(total("datagrams_pushed"), 0U);
  EXPECT_EQ(total("answers_unsent"), 1U);
  EXPECT_NE(server_.fault().find("push: "), std::string::npos) << server_.fault();
  EXPECT_NE(server_.fault().find("send to 255.255.255.255:9"), std::string::npos);

  server_.reconfigure(names_, pushing_to("127.0.0.1"));
  publish(Timestamp{seconds{2}});

  EXPECT_EQ(total("datagrams_pushed"), 1U);
  EXPECT_EQ(server_.fault(), "");
}

}  // namespace
}  // namespace crepes::subscription_server_test
