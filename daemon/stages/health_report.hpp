/// Rate and health of a stage, published once a second.
#pragma once

#include <cstddef>
#include <string>

#include "daemon/stages/stage_context.hpp"
#include "drivers/base/sensor_totals.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// Faults are logged when they change.
class HealthReport {
 public:
  /// `context` must outlive this.
  HealthReport(std::string name, const StageContext& context, bool is_calibrated = true);

  void count(std::size_t measurements) { measurements_ += measurements; }
  [[nodiscard]] bool is_due() const;
  /// True when a fault has just begun; it is published at once.
  [[nodiscard]] bool is_new_fault(const std::string& message) const {
    return !message.empty() && logged_.empty();
  }
  /// `message` is empty without a fault.
  void publish(const std::string& message, SensorTotals totals);

 private:
  std::string name_;
  const StageContext& context_;
  bool is_calibrated_;
  Timestamp period_start_;
  std::size_t measurements_ = 0;
  std::string logged_;
};

}  // namespace crepes
