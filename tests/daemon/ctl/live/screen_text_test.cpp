#include "daemon/ctl/live/screen_text.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace crepes::screen_text_test {
namespace {

constexpr ScreenFormat kColors{.columns = 80, .has_color = true};

TEST(ScreenText, CountsColumnsNotBytes) {
  EXPECT_EQ(columns_of("r2"), 2U);
  EXPECT_EQ(columns_of("\xC3\xBC\xE2\x82\xAC"), 2U);  // two letters of two and three bytes
  EXPECT_EQ(columns_of(toned("none", Tone::kBad, kColors)), 4U);
  EXPECT_EQ(columns_of("\x1b["), 0U);  // a color that has not ended
}

TEST(ScreenText, CutsBetweenLettersAndEndsColors) {
  EXPECT_EQ(cut("predicted", 4), "pred");
  EXPECT_EQ(cut("\xC3\xBC\xC3\xBC", 1), "\xC3\xBC");
  EXPECT_EQ(cut("\x1b[33mpredicted\x1b[0m", 4), "\x1b[33mpred\x1b[0m");
  EXPECT_EQ(cut("\x1b[33mab\x1b[0mcd", 3), "\x1b[33mab\x1b[0mc");
}

TEST(ScreenText, WrapsAtBlanksUnderTheBeginning) {
  EXPECT_EQ(wrapped("not seen by anybody", 12, 4, 4), "not seen\n    by\n    anybody");
  EXPECT_EQ(wrapped("all on one line", 40, 4, 4), "all on one line");
  EXPECT_EQ(wrapped("abcdefgh ij", 6, 2), "abcdef\n  gh\n  ij");
  EXPECT_EQ(wrapped("", 6, 2), "");
}

TEST(ScreenText, AlignsCellsWhateverTheirColor) {
  const std::vector<ScreenColumn> columns{{"name", 6}, {"mode", 6}};

  EXPECT_EQ(screen_row(columns, {"r2", "none"}), "r2      none");
  EXPECT_EQ(screen_row(columns, {"r2", "a long mode"}), "r2     a lon");
  EXPECT_EQ(columns_of(screen_row(columns, {"r2", toned_mode("none", kColors)})), 12U);
}

TEST(ScreenText, DropsDecimalsBeforeDigits) {
  EXPECT_EQ(fitted(-12.345, 2, 6), "-12.35");
  EXPECT_EQ(fitted(-123.45, 2, 6), "-123.5");
  EXPECT_EQ(fitted(-12345.6, 2, 6), "-12346");
  EXPECT_EQ(fitted(std::numeric_limits<double>::quiet_NaN(), 2, 6), "-");
}

}  // namespace
}  // namespace crepes::screen_text_test
