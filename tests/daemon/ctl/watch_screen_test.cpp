#include "daemon/ctl/live/watch_screen.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes {
namespace {

using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};

client::Pose pose_of(std::uint16_t id, double x, double sigma_m) {
  client::Pose message;
  message.self = 1;
  message.name = "r" + std::to_string(id);
  message.peer = id;
  message.position = {x, 0.0, 0.0};
  message.covariance.emplace();
  for (const std::size_t diagonal : {0, 6, 11, 15, 18, 20})
    message.covariance->at(diagonal) = sigma_m * sigma_m;
  return message;
}

client::Status status_of(double uptime_s, double cpu_s) {
  client::Status status;
  status.self = 1;
  status.name = "r1";
  status.uptime_s = uptime_s;
  status.cpu_s = cpu_s;
  status.sensors = {{.name = "uwb",
                     .rate_hz = 0.0,
                     .ok = false,
                     .message = "unplugged",
                     .faults = {},
                     .counts = {}}};
  client::Status::Neighbor hidden;
  hidden.peer = 4;
  hidden.name = "r4";
  hidden.state = "none";
  hidden.reason = "not seen";
  status.neighbors = {hidden};
  return status;
}

/// Three neighbors: r2 far and well known, r3 near and badly known, r4 hidden.
WatchScreen some_screen() {
  WatchScreen screen;
  screen.handle_message(status_of(10.0, 1.0), kStart);
  screen.handle_message(pose_of(2, 9.0, 0.01), kStart);
  screen.handle_message(pose_of(3, 1.0, 0.5), kStart);
  return screen;
}

bool is_before(const std::string& text, const std::string& a, const std::string& b) {
  return text.find(a) < text.find(b) && text.find(b) != std::string::npos;
}

void type(WatchScreen& screen, const std::string& keys) {
  for (const char key : keys) screen.handle_key(key);
}

TEST(WatchScreen, ShowsPosesReasonsAndWhatIsWrong) {
  const std::string text = some_screen().text(kStart, false);

  EXPECT_TRUE(is_before(text, "r2", "r3"));
  EXPECT_NE(text.find("not seen"), std::string::npos);
  EXPECT_NE(text.find("uwb: unplugged"), std::string::npos);
  EXPECT_NE(text.find("robot 1 r1, up 10 s"), std::string::npos);
}

TEST(WatchScreen, TellsTheLoadOfTheLastSecondNotOfAllTime) {
  WatchScreen screen = some_screen();
  EXPECT_NE(screen.text(kStart, false).find("10.0 % of a core"), std::string::npos);

  screen.handle_message(status_of(12.0, 2.0), kStart + seconds{2});

  EXPECT_NE(screen.text(kStart, false).find("50.0 % of a core"), std::string::npos);
}

TEST(WatchScreen, SortsByTheNextColumnAtEachS) {
  WatchScreen screen = some_screen();
  EXPECT_TRUE(is_before(screen.text(kStart, true), "r2 ", "r3 "));  // by id

  type(screen, "ss");
  const std::string by_distance = screen.text(kStart, true);
  type(screen, "s");
  const std::string by_sigma = screen.text(kStart, true);

  EXPECT_TRUE(is_before(by_distance, "r3 ", "r2 "));
  EXPECT_NE(by_distance.find("sort (distance)"), std::string::npos);
  EXPECT_TRUE(is_before(by_sigma, "r3 ", "r2 "));  // the worst first
  EXPECT_TRUE(is_before(by_sigma, "r2 ", "r4 "));  // without a pose: last
}

TEST(WatchScreen, PicksNeighborsByLettersAndArrows) {
  WatchScreen screen = some_screen();
  const auto picks = [&](const std::string& name) {
    return screen.text(kStart, true).find("> " + name) != std::string::npos;
  };

  type(screen, "j");
  EXPECT_TRUE(picks("r2"));
  type(screen, "\x1b[B");
  EXPECT_TRUE(picks("r3"));
  type(screen, "jjj");
  EXPECT_TRUE(picks("r4"));  // the end stays the end
  type(screen, "\x1b[Ak");
  EXPECT_TRUE(picks("r2"));
}

TEST(WatchScreen, WantsTheDetailsOfWhomEnterPicks) {
  WatchScreen screen = some_screen();
  EXPECT_FALSE(screen.detailed_neighbor());

  type(screen, "jj\n");
  EXPECT_EQ(screen.detailed_neighbor(), RobotId{3});

  client::Status answer;
  client::Status::Neighbor told;
  told.peer = 3;
  told.state = "direct";
  told.measurements["bearing"] = {{"fused", 77}, {"gated", 5}};
  told.ages_s["bearing"] = 0.125;
  answer.neighbors = {told};
  screen.handle_message(answer, kStart);
  EXPECT_NE(screen.text(kStart, true).find("fused 77, gated 5"), std::string::npos);
  EXPECT_NE(screen.text(kStart, true).find("125"), std::string::npos);

  type(screen, "\n");
  EXPECT_FALSE(screen.detailed_neighbor());
}

TEST(WatchScreen, QuitsAtQAndMindsNoOtherKeys) {
  WatchScreen screen = some_screen();
  type(screen, "xyz \t\x1b[C\x1b\x1b");
  EXPECT_FALSE(screen.should_quit());

  type(screen, "zq");  // z ends what the escapes began
  EXPECT_TRUE(screen.should_quit());
}

TEST(WatchScreen, SaysSinceWhenTheDaemonIsSilent) {
  EXPECT_NE(some_screen().text(kStart + seconds{7}, false).find("no answer for 7 s"),
            std::string::npos);
}

}  // namespace
}  // namespace crepes
