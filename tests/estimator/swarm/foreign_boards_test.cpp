#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/estimator_pair.hpp"

namespace crepes::foreign_boards_test {
namespace {

using namespace std::chrono_literals;
using test::EstimatorPair;

/// The share of poses whose position is off by more than 5 sigma, as `crepesctl evaluate` counts.
double share_beyond_5_sigma(const EstimatorPair& pair, Duration after) {
  double all = 0.0;
  double beyond = 0.0;
  for (const EstimatorPair::Found& found : pair.found()) {
    if (found.at <= after) continue;
    const Eigen::Vector3d error = found.error.head<3>();
    const Eigen::Matrix3d covariance = found.pose.T_B_N.covariance.topLeftCorner<3, 3>();
    all += 1.0;
    beyond += error.dot(covariance.llt().solve(error)) > 35.0 ? 1.0 : 0.0;
  }
  return beyond / all;
}

// The worst that a foreign board can do is to be read as one of ours. This one blinks the
// neighbor's own code, in another phase, 6 to 40 deg beside it, for 0.8 s of 2 s.
class AForeignBoard : public testing::TestWithParam<double> {};

TEST_P(AForeignBoard, ThatIsReadAsOursHarmsNoPose) {
  std::uint64_t refused = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    EstimatorPair pair(seed);
    pair.run_for(3s);
    const auto before = pair.count(MeasurementKind::kBearing, Verdict::kGated);
    const std::size_t poses = pair.found().size();
    for (int i = 0; i < 4; ++i) {
      pair.run_for(1200ms);
      pair.run_for(800ms, {.ghost_rad = GetParam()});
    }
    EXPECT_EQ(share_beyond_5_sigma(pair, 3s), 0.0) << "seed " << seed;
    EXPECT_GE(pair.found().size() - poses, 395U) << "a pose at every tick";
    refused += pair.count(MeasurementKind::kBearing, Verdict::kGated) - before;
  }
  EXPECT_GT(refused, 100U) << "and STATUS counts what was refused";
}

INSTANTIATE_TEST_SUITE_P(Beside, AForeignBoard, testing::Values(0.1, -0.3, 0.7));

}  // namespace
}  // namespace crepes::foreign_boards_test
