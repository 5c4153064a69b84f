#include "daemon/ctl/live/progress_bar.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes::progress_bar_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Timestamp kBegin{seconds{1000}};

TEST(ProgressBar, GrowsAndSaysWhatIsLeft) {
  const ProgressBar bar(kBegin);

  EXPECT_EQ(bar.text(0.25, kBegin + seconds{15}),
            "[##########..............................]  25 %, 45 s left");
  EXPECT_EQ(bar.text(1.0, kBegin + seconds{60}),
            "[########################################] 100 %, 0 s left");
}

TEST(ProgressBar, GuessesNothingFromTheFirstMoment) {
  const ProgressBar bar(kBegin);

  EXPECT_EQ(bar.text(0.5, kBegin + milliseconds{900}),
            "[####################....................]  50 %");
  EXPECT_EQ(bar.text(0.0, kBegin + seconds{9}), "[........................................]   0 %");
}

TEST(ProgressBar, StaysWithinItsBoundsAndALine) {
  const ProgressBar bar(kBegin);

  EXPECT_NE(bar.text(1.7, kBegin).find("100 %"), std::string::npos);
  EXPECT_LT(bar.text(0.001, kBegin + std::chrono::hours{100}).size(), 80U);
}

TEST(ProgressBar, WritesTimesInTwoUnitsAtMost) {
  EXPECT_EQ(rough_time(59.4), "59 s");
  EXPECT_EQ(rough_time(185.0), "3 min 5 s");
  EXPECT_EQ(rough_time(7800.0), "2 h 10 min");
}

}  // namespace
}  // namespace crepes::progress_bar_test
