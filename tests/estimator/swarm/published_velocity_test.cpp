/// The velocity beside a pose.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/estimator_pair.hpp"

namespace crepes::published_velocity_test {
namespace {

using namespace std::chrono_literals;
using test::EstimatorPair;

TEST(PublishedVelocity, IsThatOfTheNeighborOverGround) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    EstimatorPair pair(seed);
    pair.run_for(8s);
    double squared = 0.0;
    double squared_speed = 0.0;
    double count = 0.0;
    for (const EstimatorPair::Found& found : pair.found()) {
      if (found.at < 4s) continue;
      squared += std::pow(found.speed_error_mps, 2);
      squared_speed += found.pose.v_B_N.squaredNorm();
      ++count;
    }
    ASSERT_GT(count, 100.0);
    EXPECT_GT(std::sqrt(squared_speed / count), 0.3) << seed;  // it moves
    EXPECT_LT(std::sqrt(squared / count), 0.1) << seed;
  }
}

}  // namespace
}  // namespace crepes::published_velocity_test
