#include "daemon/devices/imu_preprocessing.hpp"

#include <cmath>

namespace crepes {

SensorTotals totals_of(const ImuCounts& counts) {
  return {.faults = {{"partial", counts.partial},
                     {"saturated", counts.saturated},
                     {"implausible", counts.implausible},
                     {"clock_restarts", counts.clock_restarts}},
          .counts = {{"samples", counts.samples}, {"unscaled", counts.unscaled}}};
}

ImuPreprocessing::ImuPreprocessing(const ImuSensorSettings& settings)
    : spacing_(from_seconds(1.0 / settings.rate_hz)),
      health_(from_seconds(1.0 / settings.rate_hz)),
      correction_(settings.device) {}

void ImuPreprocessing::apply(std::vector<ImuSample>& bundle) {
  constexpr double kMemory = 1.0 / 200.0;  // of a sample
  spacing_.apply(bundle);
  std::erase_if(bundle, [this](const ImuSample& sample) { return !health_.accept(sample); });
  for (ImuSample& sample : bundle) {
    sample = correction_.apply(sample);
    force_mps2_ += kMemory * (sample.accel_mps2.norm() - force_mps2_);
    turn_radps_ += kMemory * (sample.gyro_radps.norm() - turn_radps_);
  }
}

Totals ImuPreprocessing::faults() const {
  return {{"dropped", health_.counts().dropped}, {"stuck", health_.counts().stuck}};
}

Totals ImuPreprocessing::counts() const {
  constexpr double kMilli = 1e3;
  return {{"force_mmps2", static_cast<std::uint64_t>(std::lround(kMilli * force_mps2_))},
          {"turn_mradps", static_cast<std::uint64_t>(std::lround(kMilli * turn_radps_))}};
}

}  // namespace crepes
