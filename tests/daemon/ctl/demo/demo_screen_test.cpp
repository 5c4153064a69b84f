#include "daemon/ctl/demo/demo_screen.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace crepes::demo_screen_test {
namespace {

constexpr ScreenFormat kTerminal{.columns = 80, .is_interactive = true};

std::vector<DemoRow> some_rows() {
  return {{.pair = "r10->r12",
           .known = DemoRow::Known{.mode = "predicted",
                                   .range_m = 123.45,
                                   .error_m = 12.345,
                                   .error_deg = 179.99,
                                   .sigma_m = 0.123,
                                   .sigma_deg = 12.34,
                                   .age_ms = 19.9},
           .reason = "",
           .first_pose_s = 12.34},
          {.pair = "r1->r2",
           .known = {},
           .reason = "a reason that would not fit beside the other columns of a line, and is not "
                     "cut either"}};
}

std::size_t widest_line(const std::string& text) {
  std::istringstream lines(text);
  std::size_t widest = 0;
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, columns_of(line));
  return widest;
}

TEST(DemoScreen, FitsEightyColumnsWithTheWholeReason) {
  const std::string text = DemoScreen().text("head\n", some_rows(), kTerminal);

  EXPECT_LE(widest_line(text), 80U) << text;
  EXPECT_NE(text.find("is not"), std::string::npos);
  EXPECT_NE(text.find("either"), std::string::npos);
  EXPECT_NE(text.find("12.345"), std::string::npos);
}

TEST(DemoScreen, EndsAtQAndExplainsItselfAtTheQuestionMark) {
  DemoScreen screen;
  screen.handle_key('?');
  const std::string help = screen.text("head\n", some_rows(), kTerminal);
  EXPECT_NE(help.find("end the demo"), std::string::npos);
  EXPECT_LE(widest_line(help), 80U);
  EXPECT_EQ(help.find("r1->r2"), std::string::npos);

  screen.handle_key('x');
  EXPECT_NE(screen.text("head\n", some_rows(), kTerminal).find("r1->r2"), std::string::npos);
  EXPECT_FALSE(screen.should_quit());

  screen.handle_key('q');
  EXPECT_TRUE(screen.should_quit());
}

TEST(DemoScreen, NamesNoKeysInAFile) {
  EXPECT_EQ(DemoScreen().text("head\n", some_rows(), {}).find("q end"), std::string::npos);
}

}  // namespace
}  // namespace crepes::demo_screen_test
