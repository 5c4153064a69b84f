#include "estimator/swarm/outcome_log.hpp"

#include "estimator/swarm/measurement.hpp"

namespace crepes {
namespace {

/// Moves a mean over about the last `memory` values.
void follow(std::optional<double>& mean, double value, double memory) {
  mean = mean.value_or(value) + (value - mean.value_or(value)) / memory;
}

}  // namespace

void OutcomeLog::add(Timestamp stamp, MeasurementKind kind, const Fusion& fusion,
                     const SensorReading& reading) {
  ++counts_[static_cast<std::size_t>(kind)][static_cast<std::size_t>(fusion.verdict)];
  // Of alternatives, which have the same stamp, the one that was fused.
  std::optional<NewestReading>& newest = newest_[static_cast<std::size_t>(kind)];
  if (!newest || stamp > newest->stamp ||
      (stamp == newest->stamp && newest->verdict != Verdict::kFused)) {
    newest = NewestReading{stamp, fusion.verdict, reading};
  }
  if (fusion.dimension > 0) {
    if (is_range(kind)) follow(range_residual_m_, fusion.residual[0], 16.0);
    if (fusion.verdict == Verdict::kFused) {
      follow(nis_.at(static_cast<std::size_t>(kind)),
             fusion.nis / static_cast<double>(fusion.dimension), 50.0);
    }
  }
  if (keeps_records_) records_.measurements.push_back({neighbor_, stamp, kind, fusion, reading});
}

void OutcomeLog::add(std::optional<CalibrationRecord> calibration) {
  if (!keeps_records_ || !calibration) return;
  calibration->neighbor = neighbor_;
  records_.calibrations.push_back(*calibration);
}

void OutcomeLog::write_to(NeighborStatus& status) const {
  status.measurements = counts_;
  status.newest = newest_;
  status.nis = nis_;
  status.range_residual_m = range_residual_m_;
}

}  // namespace crepes
