#include "estimator/swarm/outcome_log.hpp"

#include <gtest/gtest.h>

namespace crepes::outcome_log_test {
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

TEST(OutcomeLog, KeepsTheNewestReadingOfEachKindAndOfAlternativesTheFusedOne) {
  OutcomeLog log(RobotId{2});
  const Timestamp t{Duration{100}};
  const Fusion gated{.verdict = Verdict::kGated};
  log.add(t, MeasurementKind::kBearing, gated, {1.0, 0.0, 0.0});
  log.add(t, MeasurementKind::kBearing, residual(0.1, 2), {0.0, 1.0, 0.0});
  log.add(t, MeasurementKind::kBearing, gated, {0.0, 0.0, 1.0});
  log.add(t - Duration{1}, MeasurementKind::kBearing, gated, {-1.0, 0.0, 0.0});
  NeighborStatus status;

  log.write_to(status);

  const auto& newest = status.newest[static_cast<std::size_t>(MeasurementKind::kBearing)];
  EXPECT_EQ(newest.value().stamp, t);
  EXPECT_EQ(newest.value().verdict, Verdict::kFused);
  EXPECT_EQ(newest.value().reading, (SensorReading{0.0, 1.0, 0.0}));
  EXPECT_FALSE(status.newest[static_cast<std::size_t>(MeasurementKind::kRange)]);
}

}  // namespace
}  // namespace crepes::outcome_log_test
