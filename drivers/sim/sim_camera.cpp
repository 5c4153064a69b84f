#include "drivers/sim/sim_camera.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/base/sleep.hpp"

namespace crepes {

SimCamera::SimCamera(RingRenderer renderer, const CameraCalibration& config, const SimClock& clock)
    : renderer_(std::move(renderer)),
      clock_(clock),
      rate_hz_(config.rate_hz),
      timeshift_(from_seconds(config.timeshift_cam_imu)),
      next_(static_cast<std::int64_t>(std::ceil(clock.world_s() * config.rate_hz))) {}

Result<std::optional<Frame>> SimCamera::read_once(std::chrono::milliseconds timeout) {
  const Duration wait = from_seconds(static_cast<double>(next_) / rate_hz_ - clock_.world_s());
  sleep_for(std::min<Duration>(wait, timeout));
  const auto latest = static_cast<std::int64_t>(std::floor(clock_.world_s() * rate_hz_));
  if (latest < next_) return std::optional<Frame>{};

  superseded_ += static_cast<std::uint64_t>(latest - next_);
  ++frames_;
  next_ = latest + 1;
  const double shutter_s = static_cast<double>(latest) / rate_hz_;
  Frame frame = renderer_.render(shutter_s);
  frame.stamp = clock_.local_time(shutter_s) - timeshift_;  // t_imu = t_cam + shift
  return std::optional(std::move(frame));
}

Result<void> SimCamera::set_light(const CameraLight& light) {
  constexpr double kNominalExposure = 500.0;  // us
  constexpr double kDecibels = 20.0;          // that are a factor of ten
  renderer_.set_brightness(light.exposure_us.value_or(kNominalExposure) / kNominalExposure *
                           std::pow(10.0, light.gain.value_or(0.0) / kDecibels));
  return {};
}

SensorTotals SimCamera::counters() const {
  return {.faults = {}, .counts = {{"frames", frames_}, {"superseded", superseded_}}};
}

}  // namespace crepes
