#include "estimator/swarm/outcome_log.hpp"

namespace crepes {
namespace {

bool is_range(MeasurementKind kind) {
  return kind == MeasurementKind::kRange || kind == MeasurementKind::kPeerRange;
}

}  // namespace

void OutcomeLog::add(Timestamp stamp, MeasurementKind kind, const Fusion& fusion,
                     const SensorReading& reading) {
  ++counts_[static_cast<std::size_t>(kind)][static_cast<std::size_t>(fusion.verdict)];
  // Of alternatives, which have the same stamp, the one that was fused.
  std::optional<NewestReading>& newest = newest_[static_cast<std::size_t>(kind)];
  if (!newest || stamp > newest->stamp ||
      (stamp == newest->stamp && newest->verdict != Verdict::kFused))
    newest = NewestReading{stamp, fusion.verdict, reading};
  if (is_range(kind) && fusion.dimension > 0) {
    constexpr double kMemory = 16.0;  // measurements
    const double mean = range_residual_m_.value_or(fusion.residual[0]);
    range_residual_m_ = mean + (fusion.residual[0] - mean) / kMemory;
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
  status.range_residual_m = range_residual_m_;
}

}  // namespace crepes
