/// A camera with fault detection.
#pragma once

#include <memory>
#include <utility>

#include "drivers/camera/camera.hpp"
#include "drivers/camera/camera_config.hpp"
#include "drivers/camera/frame_health.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Ends the stream of a camera that stalls, repeats an image or delivers another resolution.
class WatchedCamera final : public Camera {
 public:
  /// `clock` must outlive this.
  WatchedCamera(std::unique_ptr<Camera> camera, const CameraConfig& config, const Clock& clock)
      : camera_(std::move(camera)),
        health_(config),
        is_free_running_(config.device.trigger == CameraTrigger::kFree),
        clock_(clock),
        last_frame_(clock.now()) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override {
    constexpr Duration kStall = std::chrono::milliseconds(1500);
    Result<std::optional<Frame>> frame = camera_->read_once(timeout);
    if (!frame) return frame;
    const Timestamp now = clock_.now();
    if (*frame) {
      last_frame_ = now;
      if (Result<void> good = health_.check(**frame); !good) return tl::unexpected(good.error());
    } else if (is_free_running_ && now - last_frame_ > kStall) {
      return fail(ErrorCode::kIo, "no frame for 1.5 s: unplugged, or the link is too slow");
    }
    return frame;
  }
  void recycle(Frame frame) override { camera_->recycle(std::move(frame)); }
  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    return camera_->set_light(light);
  }
  [[nodiscard]] SensorTotals counters() const override { return camera_->counters(); }
  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    std::optional<std::string> fault = camera_->diagnosis();
    return fault ? fault : health_.diagnosis();
  }

 private:
  std::unique_ptr<Camera> camera_;
  FrameHealth health_;
  bool is_free_running_;
  const Clock& clock_;
  Timestamp last_frame_;
};

}  // namespace crepes
