#include <gtest/gtest.h>

#include "tests/support/estimator_pair.hpp"

namespace crepes::predicted_ids_test {
namespace {

using namespace std::chrono_literals;
using test::EstimatorPair;

/// Mahalanobis of the position; `crepesctl evaluate` counts more than 5 sigma.
double position_sigmas(const EstimatorPair::Found& found) {
  const Eigen::Vector3d error = found.error.head<3>();
  const Eigen::Matrix3d covariance = found.pose.T_B_N.covariance.topLeftCorner<3, 3>();
  return std::sqrt(error.dot(covariance.llt().solve(error)));
}

double worst_position_sigmas(const EstimatorPair& pair, Duration after) {
  double worst = 0.0;
  for (const EstimatorPair::Found& found : pair.found())
    if (found.at > after) worst = std::max(worst, position_sigmas(found));
  return worst;
}

TEST(PredictedIds, NameARobotInItsFirstFrameAfterSeconds) {
  int returns = 0;
  int named = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    EstimatorPair pair(seed);
    pair.run_for(3s);
    for (int i = 0; i < 4; ++i) {
      pair.run_for(1200ms, {.in_view = false});
      pair.run_for(800ms);
    }
    const PredictedIds ids = pair.estimator_status().predicted_ids;
    EXPECT_GE(ids.confirmed, 2U) << "seed " << seed;
    EXPECT_EQ(ids.unconfirmed, 0U) << "seed " << seed;
    EXPECT_LT(worst_position_sigmas(pair, 3s), 5.0) << "seed " << seed;
    returns += pair.returns();
    named += pair.named_returns();
  }
  std::printf("%d of %d returns were named in their first frame\n", named, returns);
  EXPECT_GE(named, 0.8 * returns);
}

// The lamp is where the hidden robot is expected, or a little beside.
TEST(PredictedIds, DoNotLetALampPullThePose) {
  int predicted = 0;
  for (const double aside : {0.0, 0.005, 0.01, -0.02}) {
    EstimatorPair pair(7);
    pair.run_for(4s);
    pair.run_for(1200ms, {.in_view = false});
    const auto fused = pair.count(MeasurementKind::kBearing, Verdict::kFused);
    for (int i = 0; i < 4; ++i) {
      pair.run_for(500ms, {.in_view = false, .decoy_rad = aside, .is_lamp = true});
      pair.run_for(1200ms, {.in_view = false});
    }
    predicted += pair.named(Naming::kPredicted);

    EXPECT_EQ(pair.count(MeasurementKind::kBearing, Verdict::kFused), fused) << aside;
    EXPECT_LT(worst_position_sigmas(pair, 3s), 5.0) << aside;
    EXPECT_EQ(pair.estimator_status().predicted_ids.confirmed, 0U) << aside;
  }
  EXPECT_GT(predicted, 10) << "until it shines where the board would be dark";
}

}  // namespace
}  // namespace crepes::predicted_ids_test
