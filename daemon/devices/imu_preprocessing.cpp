#include "daemon/devices/imu_preprocessing.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::uint64_t kRememberedSamples = 200;  // samples

}  // namespace

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
  spacing_.apply(bundle);
  std::erase_if(bundle, [this](const ImuSample& sample) { return !health_.accept(sample); });
  for (ImuSample& sample : bundle) {
    sample = correction_.apply(sample);
    const double weight = 1.0 / static_cast<double>(std::min(++samples_, kRememberedSamples));
    force_mps2_ += weight * (sample.accel_mps2.norm() - force_mps2_);
    turn_radps_ += weight * (sample.gyro_radps.norm() - turn_radps_);
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

// No robot falls freely for so long, or bears twenty times its weight: the estimator refuses such
// samples.
std::optional<std::string> ImuPreprocessing::diagnosis() const {
  constexpr double kLeastForce = 0.3 * kGravityMps2;
  constexpr double kMostForce = 20.0 * kGravityMps2;
  if (auto fault = health_.diagnosis()) return fault;
  if (samples_ < kRememberedSamples || (force_mps2_ >= kLeastForce && force_mps2_ <= kMostForce))
    return std::nullopt;
  return "the accelerometer does not show gravity, 9.81 m/s^2: it reports another unit, such as g, "
         "or has another range; its samples are not used";
}

}  // namespace crepes
