#include "estimator/relative/chi_square.hpp"

#include <gtest/gtest.h>

namespace crepes::chi_square_test {
namespace {

TEST(ChiSquare, NormalQuantilesMatchTheTable) {
  EXPECT_NEAR(normal_quantile(0.5), 0.0, 5e-4);
  EXPECT_NEAR(normal_quantile(0.9), 1.2816, 5e-4);
  EXPECT_NEAR(normal_quantile(0.99), 2.3263, 5e-4);
  EXPECT_NEAR(normal_quantile(0.999), 3.0902, 5e-4);
  EXPECT_NEAR(normal_quantile(0.999999), 4.7534, 5e-4);
}

struct Entry {
  double p;
  int degrees_of_freedom;
  double quantile;
};

class ChiSquareTable : public testing::TestWithParam<Entry> {};

TEST_P(ChiSquareTable, MatchesWithinTwoPercent) {
  const auto [p, degrees_of_freedom, quantile] = GetParam();

  EXPECT_NEAR(chi_square_quantile(p, degrees_of_freedom) / quantile, 1.0, 0.02);
}

INSTANTIATE_TEST_SUITE_P(
    Quantiles, ChiSquareTable,
    testing::Values(Entry{0.90, 1, 2.706}, Entry{0.95, 1, 3.841}, Entry{0.99, 1, 6.635},
                    Entry{0.999, 1, 10.828}, Entry{0.90, 2, 4.605}, Entry{0.95, 2, 5.991},
                    Entry{0.99, 2, 9.210}, Entry{0.999, 2, 13.816}, Entry{0.95, 6, 12.592},
                    Entry{0.99, 6, 16.812}, Entry{0.999, 6, 22.458}, Entry{0.95, 9, 16.919},
                    Entry{0.99, 9, 21.666}, Entry{0.999, 9, 27.877}, Entry{0.99, 100, 135.807},
                    Entry{0.9999, 1, 15.137}, Entry{0.95, 3, 7.815}, Entry{0.999, 3, 16.266}));

}  // namespace
}  // namespace crepes::chi_square_test
