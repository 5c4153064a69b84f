// Robots that pass each other at many meters a second.
#include <gtest/gtest.h>

#include "tests/support/estimator_pair.hpp"

namespace crepes::fast_robots_test {
namespace {

using namespace std::chrono_literals;
using test::EstimatorPair;

class FastRobots : public testing::TestWithParam<double> {};

TEST_P(FastRobots, HavePosesAtOnce) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    EstimatorPair pair(seed);
    pair.drive_off({0.0, GetParam(), 0.0});
    pair.run_for(450ms);
    ASSERT_NE(pair.latest(), nullptr) << seed;
    EXPECT_LT(pair.latest()->error.head<3>().norm(), 0.5) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(MetersPerSecond, FastRobots, testing::Values(0.0, 10.0, 16.0));

}  // namespace
}  // namespace crepes::fast_robots_test
