#include "estimator/swarm/range_screen.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/resting_pair.hpp"

namespace crepes::range_screen_test {
namespace {

using namespace test::resting;

/// Ranges every 20 ms whose first paths are weaker than what was received.
class Screen {
 public:
  /// What they have in common [m]; not a number if the range is refused.
  double shared_m(double gap_db) {
    ms_ += 20;
    const UwbRange range{at_ms(ms_), RobotId{2}, kDistance, -80.0 - gap_db, -80.0};
    const auto reading = screen_.accept(range, settings());
    return reading ? reading->shared_m : std::numeric_limits<double>::quiet_NaN();
  }
  /// The most over many ranges whose gaps alternate.
  double most_m(double gap_db, double other_gap_db) {
    double most_m = 0.0;
    for (int i = 0; i < 200; ++i)
      most_m = std::max(most_m, shared_m(i % 2 == 0 ? gap_db : other_gap_db));
    return most_m;
  }

 private:
  RangeScreen screen_;
  int ms_ = 0;
};

TEST(RangeScreen, DoubtsRangesTheMoreTheWeakerTheirFirstPathBecomes) {
  Screen screen;
  ASSERT_EQ(screen.most_m(1.0, 2.0), 0.0);

  double last_m = 0.0;
  for (double gap_db = 3.5; gap_db < 8.0; gap_db += 0.5) {
    const double shared_m = screen.shared_m(gap_db);
    EXPECT_GT(shared_m, last_m) << gap_db;
    last_m = shared_m;
  }

  EXPECT_GT(last_m, 0.4);
  EXPECT_TRUE(std::isnan(screen.shared_m(8.5)));
}

// An obstacle delays the ranges about those that show it. One weak first path is chance.
TEST(RangeScreen, DoubtsRangesForAMomentAfterSeveralWeakFirstPaths) {
  Screen screen;
  ASSERT_EQ(screen.most_m(1.0, 2.0), 0.0);
  EXPECT_GT(screen.shared_m(6.0), 0.2);
  EXPECT_EQ(screen.shared_m(1.0), 0.0);

  for (int i = 0; i < 25; ++i) screen.shared_m(6.0);
  double last_m = screen.shared_m(1.0);
  EXPECT_GT(last_m, 0.2);
  for (int i = 0; i < 10; ++i) {
    const double shared_m = screen.shared_m(1.0);
    EXPECT_LT(shared_m, last_m);
    last_m = shared_m;
  }
  EXPECT_GT(last_m, 0.1);
  for (int i = 0; i < 75; ++i) last_m = screen.shared_m(1.0);
  EXPECT_EQ(last_m, 0.0);
}

TEST(RangeScreen, DoubtsNoRangesWhoseFirstPathIsAsWeakAsUsual) {
  Screen screen;
  for (int i = 0; i < 20; ++i) screen.shared_m(i % 2 == 0 ? 5.0 : 6.0);

  EXPECT_EQ(screen.most_m(5.0, 6.0), 0.0);
}

TEST(RangeScreen, LearnsNothingOfPowersThatAreNotNumbers) {
  Screen screen;
  ASSERT_EQ(screen.most_m(1.0, 2.0), 0.0);
  screen.shared_m(std::numeric_limits<double>::quiet_NaN());

  EXPECT_GT(screen.shared_m(6.0), 0.2);
}

}  // namespace
}  // namespace crepes::range_screen_test
