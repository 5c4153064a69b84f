#include "drivers/camera/libcamera_camera.hpp"

#include <utility>

#include "drivers/camera/frame_sequence.hpp"
#include "drivers/camera/grey_conversion.hpp"
#include "drivers/device_clock.hpp"

namespace crepes {
namespace {

/// Converts a whole buffer to 8 bits a pixel.
void narrow(const LibcameraStream& stream, std::span<const std::uint8_t> rows,
            std::vector<std::uint8_t>& grey) {
  switch (stream.layout.packing) {
    case GreyPacking::kPacked10:
      return unpack_upper_bytes(rows, stream.width, stream.height, stream.stride, 4, grey);
    case GreyPacking::kPacked12:
      return unpack_upper_bytes(rows, stream.width, stream.height, stream.stride, 2, grey);
    default:
      return narrow_to_8_bits(rows, stream.width, stream.height, stream.stride, stream.layout.bits,
                              grey);
  }
}

class LibcameraCamera final : public Camera {
 public:
  LibcameraCamera(std::shared_ptr<LibcameraDevice> device, const CameraConfig& config,
                  std::uint8_t index, const Clock& clock)
      : device_(std::move(device)),
        index_(index),
        clock_(clock),
        latency_(from_seconds(config.device.latency_ms * 1e-3)),
        period_us_(1e6 / config.calibration.rate_hz) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override {
    std::optional<Frame> newest;
    for (auto wait = timeout;; wait = std::chrono::milliseconds::zero()) {
      const Result<std::optional<LibcameraFrame>> next = device_->next(wait);
      if (!next) return tl::unexpected(next.error());
      if (!*next) return newest;
      sequence_.add((*next)->sequence);
      if (!(*next)->is_whole) {
        ++incomplete_;
        device_->requeue((*next)->buffer);
        continue;
      }
      if (newest) ++superseded_;
      newest = frame_of(**next);
    }
  }

  void recycle(Frame frame) override {
    if (spare_.empty()) spare_ = std::move(frame.pixels);
  }

  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    return device_->set_light(light);
  }

  [[nodiscard]] SensorTotals counters() const override {
    return {.faults = {{"missed", sequence_.missed()},
                       {"incomplete", incomplete_},
                       {"clock_restarts", device_clock_.restarts()}},
            .counts = {{"frames", frames_}, {"superseded", superseded_}}};
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    if (!is_exposure_long_) return std::nullopt;
    return kExposureTooLong;
  }

 private:
  Frame frame_of(const LibcameraFrame& taken) {
    const LibcameraStream& stream = device_->stream();
    std::optional<DeviceTime> stamp;
    if (taken.sensor_ns) stamp = DeviceTime{*taken.sensor_ns};
    Frame frame{.stamp = device_clock_.to_local(stamp, clock_.now()) - latency_,
                .camera = index_,
                .width = stream.width,
                .height = stream.height};
    ++frames_;
    is_exposure_long_ = taken.exposure_us > period_us_;
    const std::span<const std::uint8_t> memory = device_->memory(taken.buffer);
    if (stream.layout.packing != GreyPacking::kBytes) {
      frame.pixels = std::exchange(spare_, {});
      narrow(stream, memory, frame.pixels);
      device_->requeue(taken.buffer);
      return frame;
    }
    frame.borrowed_stride = static_cast<std::ptrdiff_t>(stream.stride);
    frame.borrowed =
        BorrowedPixels(memory.data(), [device = device_, buffer = taken.buffer](
                                          const std::uint8_t*) { device->requeue(buffer); });
    return frame;
  }

  std::shared_ptr<LibcameraDevice> device_;  // shared with the frames that are in its buffers
  std::uint8_t index_;
  const Clock& clock_;
  Duration latency_;
  double period_us_;
  DeviceClock device_clock_;
  FrameSequence sequence_;
  std::vector<std::uint8_t> spare_;
  bool is_exposure_long_ = false;
  std::uint64_t frames_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace

Result<std::unique_ptr<Camera>> open_libcamera_camera(const CameraConfig& config,
                                                      std::uint8_t index, const Clock& clock) {
  Result<std::unique_ptr<LibcameraDevice>> device = open_libcamera_device(config);
  if (!device) return tl::unexpected(device.error());
  return make_libcamera_camera(std::move(*device), config, index, clock);
}

std::unique_ptr<Camera> make_libcamera_camera(std::unique_ptr<LibcameraDevice> device,
                                              const CameraConfig& config, std::uint8_t index,
                                              const Clock& clock) {
  return std::make_unique<LibcameraCamera>(std::move(device), config, index, clock);
}

}  // namespace crepes
