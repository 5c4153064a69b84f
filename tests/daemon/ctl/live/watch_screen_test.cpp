#include "daemon/ctl/live/watch_screen.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <set>
#include <sstream>

namespace crepes::watch_screen_test {
namespace {

using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};
constexpr ScreenFormat kFile{};
constexpr ScreenFormat kTerminal{.columns = 80, .is_interactive = true};

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
  const std::string text = some_screen().text(kStart, kFile);

  EXPECT_TRUE(is_before(text, "r2", "r3"));
  EXPECT_NE(text.find("not seen"), std::string::npos);
  EXPECT_NE(text.find("uwb: unplugged"), std::string::npos);
  EXPECT_NE(text.find("robot 1 r1, up 10 s"), std::string::npos);
}

TEST(WatchScreen, ShowsTheLoadOfTheLastSecondNotOfAllTime) {
  WatchScreen screen = some_screen();
  EXPECT_NE(screen.text(kStart, kFile).find("10.0 % of a core"), std::string::npos);

  screen.handle_message(status_of(12.0, 2.0), kStart + seconds{2});

  EXPECT_NE(screen.text(kStart, kFile).find("50.0 % of a core"), std::string::npos);
}

TEST(WatchScreen, WantsToAskForWhomStatusHadNoRoom) {
  WatchScreen screen = some_screen();
  EXPECT_TRUE(screen.polled_neighbors().empty());
  client::Status status = status_of(11.0, 1.0);
  for (const std::uint16_t id : {4, 5}) {  // as under "more"
    client::Status::Neighbor& neighbor = status.neighbors.emplace_back();
    neighbor.peer = id;
  }
  status.neighbors.erase(status.neighbors.begin());
  screen.handle_message(status, kStart);

  EXPECT_EQ(screen.polled_neighbors(), (std::set{RobotId{4}, RobotId{5}}));
  EXPECT_NE(screen.text(kStart, kFile).find("not seen"), std::string::npos) << "as r4 was last";

  client::Status answer;
  answer.neighbors = status_of(11.0, 1.0).neighbors;
  answer.neighbors[0].peer = 5;
  answer.neighbors[0].name = "r5";
  answer.neighbors[0].reason = "never heard";
  screen.handle_message(answer, kStart);

  EXPECT_NE(screen.text(kStart, kFile).find("never heard"), std::string::npos);
}

TEST(WatchScreen, SortsByTheNextColumnAtEachS) {
  WatchScreen screen = some_screen();
  EXPECT_TRUE(is_before(screen.text(kStart, kTerminal), "r2 ", "r3 "));  // by id

  type(screen, "ss");
  const std::string by_distance = screen.text(kStart, kTerminal);
  type(screen, "s");
  const std::string by_sigma = screen.text(kStart, kTerminal);

  EXPECT_TRUE(is_before(by_distance, "r3 ", "r2 "));
  EXPECT_NE(by_distance.find("sort (distance)"), std::string::npos);
  EXPECT_TRUE(is_before(by_sigma, "r3 ", "r2 "));  // the worst first
  EXPECT_TRUE(is_before(by_sigma, "r2 ", "r4 "));  // without a pose: last
}

TEST(WatchScreen, PicksNeighborsByLettersAndArrows) {
  WatchScreen screen = some_screen();
  const auto picks = [&](const std::string& name) {
    return screen.text(kStart, kTerminal).find("> " + name) != std::string::npos;
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
  client::Status::Neighbor reported;
  reported.peer = 3;
  reported.state = "direct";
  reported.measurements["bearing"] = {{"fused", 77}, {"gated", 5}};
  reported.ages_s["bearing"] = 0.125;
  answer.neighbors = {reported};
  screen.handle_message(answer, kStart);
  EXPECT_NE(screen.text(kStart, kTerminal).find("fused 77, gated 5"), std::string::npos);
  EXPECT_NE(screen.text(kStart, kTerminal).find("125"), std::string::npos);

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

std::size_t widest_line(const std::string& text) {
  std::istringstream lines(text);
  std::size_t widest = 0;
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, columns_of(line));
  return widest;
}

/// As wide as numbers get: far away, turned by nearly 180 degrees, badly known.
client::Pose widest_pose(std::uint16_t id) {
  client::Pose message = pose_of(id, -123.456, 0.999);
  message.name = "reconnaissance-12";
  message.mode = client::Mode::kPredicted;
  message.position = {-123.456, -98.765, -43.21};
  const double half = -179.9 / 180.0 * std::numbers::pi / 2.0;
  message.orientation = {std::cos(half), 0.0, 0.0, std::sin(half)};
  message.age_s = 0.0199;
  return message;
}

TEST(WatchScreen, FitsEightyColumnsWithTheWholeReason) {
  const std::string reason =
      "a reason that is much longer than any that the daemon has at the moment, because the next "
      "one may be longer";
  client::Status status = status_of(123456.0, 1.0);
  status.sensors.front().message = reason;
  status.neighbors.front().reason = reason;
  WatchScreen screen;
  screen.handle_message(status, kStart);
  screen.handle_message(widest_pose(2), kStart);
  type(screen, "jj\n");

  const std::string text = screen.text(kStart, kTerminal);

  EXPECT_LE(widest_line(text), 80U) << text;
  std::istringstream words(reason);
  for (std::string word; words >> word;) EXPECT_NE(text.find(word), std::string::npos) << word;
  EXPECT_NE(text.find("-123.5"), std::string::npos) << "numbers lose decimals, not digits";
}

TEST(WatchScreen, UsesTheRoomOfAWideTerminal) {
  const ScreenFormat wide{.columns = 120, .is_interactive = true};
  WatchScreen screen;
  screen.handle_message(widest_pose(2), kStart);

  const std::string text = screen.text(kStart, wide);

  EXPECT_NE(text.find("-123.456"), std::string::npos) << text;
  EXPECT_NE(text.find("-179.9"), std::string::npos) << text;
  EXPECT_LE(widest_line(text), 120U);
}

TEST(WatchScreen, ColorsOnlyWhereTheyAreSeen) {
  const ScreenFormat colored{.columns = 80, .is_interactive = true, .has_color = true};
  const WatchScreen screen = some_screen();

  EXPECT_EQ(screen.text(kStart, kTerminal).find('\x1b'), std::string::npos);
  EXPECT_NE(screen.text(kStart, colored).find("\x1b["), std::string::npos);
  EXPECT_EQ(widest_line(screen.text(kStart, colored)), widest_line(screen.text(kStart, kTerminal)));
}

TEST(WatchScreen, ExplainsKeysAndColumnsUntilTheNextKey) {
  WatchScreen screen = some_screen();

  type(screen, "?");
  const std::string help = screen.text(kStart, kTerminal);
  EXPECT_NE(help.find("any other key closes it"), std::string::npos);
  EXPECT_NE(help.find("predicted"), std::string::npos);
  EXPECT_LE(widest_line(help), 80U);

  type(screen, "s");
  EXPECT_NE(screen.text(kStart, kTerminal).find("sort (id)"), std::string::npos)
      << "the key that closes the help does nothing else";
  type(screen, "?q");
  EXPECT_TRUE(screen.should_quit());
}

TEST(WatchScreen, HasALegendAndKeysForThoseWhoCanPressThem) {
  EXPECT_NE(some_screen().text(kStart, kTerminal).find("by way of others"), std::string::npos);
  EXPECT_NE(some_screen().text(kStart, kTerminal).find("? help"), std::string::npos);
  EXPECT_EQ(some_screen().text(kStart, kFile).find("help"), std::string::npos);
}

TEST(WatchScreen, SaysSinceWhenTheDaemonIsSilent) {
  EXPECT_NE(some_screen().text(kStart + seconds{7}, kFile).find("no answer for 7 s"),
            std::string::npos);
}

}  // namespace
}  // namespace crepes::watch_screen_test
