#include "daemon/devices/camera_sensor.hpp"

#include <optional>
#include <utility>

namespace crepes {
namespace {

using std::chrono::milliseconds;

class CameraDevice final : public Device {
 public:
  CameraDevice(std::unique_ptr<Camera> camera, const Clock& clock, FrameQueue& frames,
               FrameQueue& recycled)
      : camera_(std::move(camera)), clock_(clock), frames_(frames), recycled_(recycled) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    while (auto frame = recycled_.try_pop()) camera_->recycle(std::move(*frame));
    Result<std::optional<Frame>> frame = camera_->read_once(timeout);
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return 0;
    (*frame)->arrival = clock_.now();
    frames_.push(std::move(**frame));
    return 1;
  }

  [[nodiscard]] SensorTotals counters() const override { return camera_->counters(); }
  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    return camera_->diagnosis();
  }

 private:
  std::unique_ptr<Camera> camera_;
  const Clock& clock_;
  FrameQueue& frames_;
  FrameQueue& recycled_;
};

}  // namespace

Sensor camera_sensor(const std::string& name, const OpenCamera& open, const Clock& clock,
                     FrameQueue& frames, FrameQueue& recycled) {
  Sensor sensor;
  sensor.name = name;
  sensor.silence_hint = "no frame: is the camera plugged in and running?";
  sensor.open = [=, &clock, &frames, &recycled]() -> Result<std::unique_ptr<Device>> {
    while (recycled.try_pop()) continue;  // old frames would keep the previous camera open
    Result<std::unique_ptr<Camera>> camera = open();
    if (!camera) return tl::unexpected(camera.error());
    return std::make_unique<CameraDevice>(std::move(*camera), clock, frames, recycled);
  };
  return sensor;
}

}  // namespace crepes
