/// The outcomes of one neighbor's measurements: counts, and records on request.
#pragma once

#include <utility>

#include "estimator/core/outputs.hpp"

namespace crepes {

class OutcomeLog {
 public:
  explicit OutcomeLog(RobotId neighbor) : neighbor_(neighbor) {}

  /// Keeps a record of each measurement, and of the calibration, until `drain_records`.
  void keep_records() { keeps_records_ = true; }
  [[nodiscard]] Records drain_records() { return std::exchange(records_, {}); }

  /// Counts the outcome of a measurement, and records it if asked to, with what was read.
  void add(Timestamp stamp, MeasurementKind kind, const Fusion& fusion,
           const SensorReading& reading = {});
  /// Records a calibration, if asked to.
  void add(std::optional<CalibrationRecord> calibration);
  [[nodiscard]] bool keeps_records() const { return keeps_records_; }

  /// Fills in `measurements`, `newest`, `nis` and `range_residual_m`.
  void write_to(NeighborStatus& status) const;

 private:
  RobotId neighbor_;
  std::array<VerdictCounts, kMeasurementKindCount> counts_{};
  std::array<std::optional<NewestReading>, kMeasurementKindCount> newest_{};
  std::array<std::optional<double>, kMeasurementKindCount> nis_{};
  std::optional<double> range_residual_m_;
  bool keeps_records_ = false;
  Records records_;
};

}  // namespace crepes
