#include "daemon/devices/camera_sensor.hpp"

#include <optional>
#include <utility>

namespace crepes {
namespace {

using std::chrono::milliseconds;

class CameraDevice final : public Device {
 public:
  CameraDevice(std::unique_ptr<Camera> camera, LiveLight& light, const Clock& clock,
               FrameQueue& frames, FrameQueue& recycled)
      : camera_(std::move(camera)),
        light_(light),
        clock_(clock),
        frames_(frames),
        recycled_(recycled) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    while (auto frame = recycled_.try_pop()) camera_->recycle(std::move(*frame));
    Result<std::optional<Frame>> frame = camera_->read_once(timeout);
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return 0;
    (*frame)->arrival = clock_.now();
    frames_.push(std::move(**frame));
    return 1;
  }

  [[nodiscard]] bool has_new_settings() const override { return light_.has_update(); }
  void apply_settings() override {
    const Result<void> set = camera_->set_light(light_.receive());
    refused_light_ = set ? "" : set.error().message;
  }

  [[nodiscard]] SensorTotals counters() const override { return camera_->counters(); }
  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    return refused_light_.empty() ? camera_->diagnosis() : refused_light_;
  }

 private:
  std::unique_ptr<Camera> camera_;
  LiveLight& light_;
  const Clock& clock_;
  FrameQueue& frames_;
  FrameQueue& recycled_;
  std::string refused_light_;  ///< why; empty if none was
};

}  // namespace

CameraLight LiveLight::receive() {
  if (const auto newest = settings_.receive()) {
    newest_ = *newest;
    automatic_us_.reset();
  }
  if (const auto exposure_us = exposures_us_.try_pop()) automatic_us_ = exposure_us;
  CameraLight light = newest_.light;
  if (newest_.exposure == ExposureControl::kAuto && automatic_us_)
    light.exposure_us = automatic_us_;
  return light;
}

Sensor camera_sensor(const std::string& name, const OpenCamera& open, LiveLight& light,
                     const Clock& clock, FrameQueue& frames, FrameQueue& recycled) {
  Sensor sensor;
  sensor.name = name;
  sensor.silence_hint = "no frame: is the camera plugged in and running?";
  sensor.open = [=, &light, &clock, &frames, &recycled]() -> Result<std::unique_ptr<Device>> {
    while (recycled.try_pop()) continue;  // old frames would keep the previous camera open
    Result<std::unique_ptr<Camera>> camera = open(light.receive());
    if (!camera) return tl::unexpected(camera.error());
    return std::make_unique<CameraDevice>(std::move(*camera), light, clock, frames, recycled);
  };
  return sensor;
}

}  // namespace crepes
