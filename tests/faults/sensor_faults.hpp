/// Faults of one robot's sensors.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "estimator/core/event.hpp"
#include "tests/faults/dice.hpp"
#include "tests/faults/fault.hpp"

namespace crepes::faults {

/// One fault of a robot's sensors. Kinds that are none change nothing.
class SensorFault {
 public:
  explicit SensorFault(const Fault& fault) : fault_(fault), dice_(fault.seed) {}

  [[nodiscard]] bool hits(RobotId robot, double true_s) const {
    return robot == fault_.robot && fault_.lasts_at(true_s);
  }
  /// Changes a reading; false if it is lost.
  [[nodiscard]] bool change(Event& event);

 private:
  [[nodiscard]] bool change(ImuSample& sample);
  [[nodiscard]] bool change(UwbRange& range);
  [[nodiscard]] bool change(SpotFrame& frame);
  [[nodiscard]] bool averages(ImuSample& sample);
  [[nodiscard]] Spot random_spot();

  Fault fault_;
  Dice dice_;
  std::optional<ImuSample> first_sample_;
  std::optional<std::vector<Spot>> first_spots_;
  std::deque<ImuSample> earlier_samples_;
  std::vector<ImuSample> summed_;
  std::deque<std::vector<Spot>> earlier_spots_;
};

/// All of a schedule.
class SensorFaults {
 public:
  explicit SensorFaults(const std::vector<Fault>& faults) {
    for (const Fault& fault : faults) faults_.emplace_back(fault);
  }
  [[nodiscard]] bool operator()(RobotId robot, double true_s, Event& event);

 private:
  std::vector<SensorFault> faults_;
};

}  // namespace crepes::faults
