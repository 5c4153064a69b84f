#include "estimator/swarm/outcome_log.hpp"

#include <gtest/gtest.h>

namespace crepes {
namespace {

Fusion residual(double value, std::size_t dimension = 1) {
  Fusion fusion{
      .verdict = Verdict::kFused, .nis = 1.0, .log_likelihood = 0.0, .dimension = dimension};
  fusion.residual[0] = value;
  return fusion;
}

TEST(OutcomeLog, AveragesTheResidualsOfRangesOnly) {
  OutcomeLog log(RobotId{2});
  NeighborStatus status;
  log.write_to(status);
  EXPECT_FALSE(status.range_residual_m);

  log.add(Timestamp{}, MeasurementKind::kBearing, residual(0.5, 2));
  log.add(Timestamp{}, MeasurementKind::kRange, residual(9.0, 0));  // there was none
  log.add(Timestamp{}, MeasurementKind::kRange, residual(0.0));
  for (int i = 0; i < 200; ++i) log.add(Timestamp{}, MeasurementKind::kPeerRange, residual(-0.1));
  log.write_to(status);

  EXPECT_NEAR(status.range_residual_m.value(), -0.1, 1e-4);
}

}  // namespace
}  // namespace crepes
