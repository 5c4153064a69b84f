#include "estimator/core/quantile.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace crepes::quantile_test {
namespace {

TEST(Quantile, IsAValueThatTheShareOfTheOthersDoesNotExceed) {
  std::vector<double> values{5.0, 1.0, 4.0, 2.0, 3.0};
  EXPECT_EQ(quantile(values, 0.0), 1.0);
  EXPECT_EQ(quantile(values, 0.25), 2.0);
  EXPECT_EQ(quantile(values, 0.99), 4.0) << "rounds down";
  EXPECT_EQ(quantile(values, 1.0), 5.0);
}

TEST(Quantile, OfAnEvenNumberTheMediansAreTheTwoInTheMiddle) {
  std::vector<double> values{4.0, 1.0, 3.0, 2.0};
  EXPECT_EQ(quantile(values, 0.5), 2.0);
  EXPECT_EQ(upper_median(values), 3.0);
}

TEST(Quantile, OfOneValueIsThatValue) {
  std::vector<double> values{7.0};
  EXPECT_EQ(quantile(values, 0.9), 7.0);
  EXPECT_EQ(upper_median(values), 7.0);
}

}  // namespace
}  // namespace crepes::quantile_test
