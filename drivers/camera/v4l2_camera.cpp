#include "drivers/camera/v4l2_camera.hpp"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "drivers/base/io_failure.hpp"
#include "drivers/camera/frame_sequence.hpp"
#include "drivers/camera/grey_conversion.hpp"

namespace crepes {
namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::uint32_t kV4l2Buffers = 8;
constexpr double kExposureUnit = 100.0;  // us, of V4L2_CID_EXPOSURE_ABSOLUTE
constexpr double kMicrosecondsPerSecond = 1e6;

struct GreyFormat {
  std::uint32_t code;
  int bits;
};
constexpr std::array kFormats{GreyFormat{V4L2_PIX_FMT_GREY, 8}, GreyFormat{V4L2_PIX_FMT_Y16, 16},
                              GreyFormat{V4L2_PIX_FMT_Y12, 12}, GreyFormat{V4L2_PIX_FMT_Y10, 10}};

std::string name_of(std::uint32_t format) {
  std::string name(4, ' ');
  std::memcpy(name.data(), &format, 4);
  return name;
}

/// A running device. It lives until all of its buffers have been returned.
class V4l2Session {
 public:
  V4l2Session(std::unique_ptr<V4l2Device> device, std::string name)
      : device_(std::move(device)), name_(std::move(name)) {}

  Result<void> start(const CameraConfig& config) {
    return check_abilities()
        .and_then([&] { return set_region(config); })
        .and_then([&] { return set_format(config); })
        .and_then([&] { return set_rate(config.calibration.rate_hz); })
        .and_then([&] { return set_light(config.device.light); })
        .and_then([&] { return run(); });
  }

  [[nodiscard]] bool wait(std::chrono::milliseconds timeout) { return device_->wait(timeout); }

  /// The next buffer with a frame; empty if there is none.
  Result<std::optional<v4l2_buffer>> fetch() {
    v4l2_buffer buffer = empty_buffer(0);
    const int error = device_->ioctl(VIDIOC_DQBUF, &buffer);
    if (error == EAGAIN) return std::optional<v4l2_buffer>{};
    if (error != 0) return io_failure(fmt::format("{}: the camera is gone", name_), error);
    if (buffer.index >= buffers_.size())
      return fail(ErrorCode::kIo, fmt::format("{}: a buffer that does not exist", name_));
    return std::optional(buffer);
  }
  /// Queues the buffer for the device again. If that fails, the next fetch returns the error.
  void requeue(std::uint32_t index) {
    v4l2_buffer buffer = empty_buffer(index);
    static_cast<void>(device_->ioctl(VIDIOC_QBUF, &buffer));
  }

  [[nodiscard]] std::span<const std::uint8_t> memory(std::uint32_t index) const {
    return buffers_[index];
  }
  [[nodiscard]] const v4l2_pix_format& format() const { return format_; }
  [[nodiscard]] int bits() const { return bits_; }
  /// Bytes of a whole frame.
  [[nodiscard]] std::size_t frame_size() const {
    return std::size_t{format_.bytesperline} * (format_.height - 1) +
           std::size_t{format_.width} * (bits_ > 8 ? 2 : 1);
  }
  /// The device's exposure; 0 if it does not report one.
  [[nodiscard]] double exposure_us() {
    v4l2_control control{.id = V4L2_CID_EXPOSURE_ABSOLUTE, .value = 0};
    return device_->ioctl(VIDIOC_G_CTRL, &control) == 0 ? kExposureUnit * control.value : 0.0;
  }

  Result<void> set_light(const CameraLight& light) {
    if (light.exposure_us) {
      static_cast<void>(set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL));  // may have none
      const auto units = std::max(1L, std::lround(*light.exposure_us / kExposureUnit));
      if (const int error = set(V4L2_CID_EXPOSURE_ABSOLUTE, static_cast<int>(units)); error != 0)
        return io_failure(fmt::format("{}: exposure_us", name_), error);
    }
    if (!light.gain) return {};
    static_cast<void>(set(V4L2_CID_AUTOGAIN, 0));  // may have none
    const int error = set(V4L2_CID_GAIN, static_cast<int>(std::lround(*light.gain)));
    return error == 0 ? Result<void>{} : io_failure(fmt::format("{}: gain", name_), error);
  }

 private:
  static v4l2_buffer empty_buffer(std::uint32_t index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = kCapture;
    buffer.memory = V4L2_MEMORY_MMAP;
    return buffer;
  }

  Result<void> check_abilities() {
    v4l2_capability ability{};
    if (const int error = device_->ioctl(VIDIOC_QUERYCAP, &ability); error != 0)
      return io_failure(fmt::format("{}: no video device", name_), error);
    constexpr std::uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    const std::uint32_t able = (ability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                   ? ability.device_caps
                                   : ability.capabilities;
    if ((able & kNeeded) == kNeeded) return {};
    return fail(ErrorCode::kConfig,
                fmt::format("{}: a video device that captures no frames", name_));
  }

  Result<void> set_region(const CameraConfig& config) {
    v4l2_selection region{};
    region.type = kCapture;
    if (config.device.offset == std::array{0, 0}) {
      // A crop outlives the program that set it. Most devices have none.
      region.target = V4L2_SEL_TGT_CROP_DEFAULT;
      if (device_->ioctl(VIDIOC_G_SELECTION, &region) != 0) return {};
      region.target = V4L2_SEL_TGT_CROP;
      static_cast<void>(device_->ioctl(VIDIOC_S_SELECTION, &region));
      return {};
    }
    region.target = V4L2_SEL_TGT_CROP;
    region.r = {config.device.offset[0], config.device.offset[1],
                static_cast<std::uint32_t>(config.calibration.resolution[0]),
                static_cast<std::uint32_t>(config.calibration.resolution[1])};
    const v4l2_rect wanted = region.r;
    if (const int error = device_->ioctl(VIDIOC_S_SELECTION, &region); error != 0)
      return io_failure(fmt::format("{}: offset", name_), error);
    if (region.r.left == wanted.left && region.r.top == wanted.top) return {};
    return fail(ErrorCode::kConfig, fmt::format("{}: offset: the device takes [{}, {}] instead",
                                                name_, region.r.left, region.r.top));
  }

  Result<void> set_format(const CameraConfig& config) {
    std::string offers;
    for (const GreyFormat& wanted : kFormats) {
      v4l2_format format{};
      format.type = kCapture;
      format.fmt.pix.width = static_cast<std::uint32_t>(config.calibration.resolution[0]);
      format.fmt.pix.height = static_cast<std::uint32_t>(config.calibration.resolution[1]);
      format.fmt.pix.pixelformat = wanted.code;
      format.fmt.pix.field = V4L2_FIELD_NONE;
      const int error = device_->ioctl(VIDIOC_S_FMT, &format);
      if (error == EBUSY) return io_failure(name_, error);
      if (error != 0) continue;
      format_ = format.fmt.pix;
      bits_ = wanted.bits;
      if (is_as(config, wanted)) return {};
      offers = fmt::format("; the device offers {} of [{}, {}]", name_of(format_.pixelformat),
                           format_.width, format_.height);
      if (format_.pixelformat == wanted.code) break;  // grey, with another size
    }
    return fail(ErrorCode::kConfig, fmt::format("{}: no GREY, Y16, Y12 or Y10 of [{}, {}]{}", name_,
                                                config.calibration.resolution[0],
                                                config.calibration.resolution[1], offers));
  }

  [[nodiscard]] bool is_as(const CameraConfig& config, const GreyFormat& wanted) const {
    const std::uint32_t bytes = wanted.bits > 8 ? 2 : 1;
    return format_.pixelformat == wanted.code &&
           format_.width == static_cast<std::uint32_t>(config.calibration.resolution[0]) &&
           format_.height == static_cast<std::uint32_t>(config.calibration.resolution[1]) &&
           format_.bytesperline >= bytes * format_.width;
  }

  Result<void> set_rate(double rate_hz) {
    constexpr std::uint32_t kMilli = 1000;
    v4l2_streamparm parameters{};
    parameters.type = kCapture;
    parameters.parm.capture.timeperframe = {
        kMilli, static_cast<std::uint32_t>(std::lround(rate_hz * kMilli))};
    const int error = device_->ioctl(VIDIOC_S_PARM, &parameters);
    if (error == 0 || error == ENOTTY || error == EINVAL)
      return {};  // FrameHealth reports a wrong rate
    return io_failure(fmt::format("{}: rate_hz", name_), error);
  }

  int set(std::uint32_t id, int value) {
    v4l2_control control{.id = id, .value = value};
    return device_->ioctl(VIDIOC_S_CTRL, &control);
  }

  Result<void> run() {
    v4l2_requestbuffers wanted{};
    wanted.count = kV4l2Buffers;
    wanted.type = kCapture;
    wanted.memory = V4L2_MEMORY_MMAP;
    if (const int error = device_->ioctl(VIDIOC_REQBUFS, &wanted); error != 0)
      return io_failure(fmt::format("{}: buffers", name_), error);
    for (std::uint32_t i = 0; i < wanted.count; ++i) {
      v4l2_buffer buffer = empty_buffer(i);
      if (const int error = device_->ioctl(VIDIOC_QUERYBUF, &buffer); error != 0)
        return io_failure(fmt::format("{}: buffers", name_), error);
      buffers_.push_back(device_->map(buffer.length, buffer.m.offset));
      if (buffers_.back().size() < frame_size())
        return fail(ErrorCode::kIo, fmt::format("{}: buffers that hold no frame", name_));
      requeue(i);
    }
    std::uint32_t type = kCapture;
    const int error = device_->ioctl(VIDIOC_STREAMON, &type);
    return error == 0 ? Result<void>{} : io_failure(fmt::format("{}: start", name_), error);
  }

  std::unique_ptr<V4l2Device> device_;  // closing it stops the stream
  std::string name_;
  v4l2_pix_format format_{};
  int bits_ = 8;
  std::vector<std::span<const std::uint8_t>> buffers_;
};

class V4l2Camera final : public Camera {
 public:
  V4l2Camera(std::shared_ptr<V4l2Session> session, const CameraConfig& config, std::uint8_t index,
             const Clock& clock)
      : session_(std::move(session)),
        index_(index),
        clock_(clock),
        latency_(from_seconds(config.device.latency_ms * 1e-3)),
        rate_hz_(config.calibration.rate_hz),
        is_exposure_long_(session_->exposure_us() * rate_hz_ > kMicrosecondsPerSecond) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override {
    if (!session_->wait(timeout)) return std::optional<Frame>{};
    std::optional<v4l2_buffer> newest;
    for (;;) {
      const Result<std::optional<v4l2_buffer>> next = session_->fetch();
      if (!next) return tl::unexpected(next.error());
      if (!*next) break;
      sequence_.add((*next)->sequence);
      if (!is_whole(**next)) {
        session_->requeue((*next)->index);
        continue;
      }
      if (newest) {
        ++superseded_;
        session_->requeue(newest->index);
      }
      newest = *next;
    }
    if (!newest) return std::optional<Frame>{};
    return std::optional(frame_of(*newest));
  }

  void recycle(Frame frame) override {
    if (spare_.empty()) spare_ = std::move(frame.pixels);
  }

  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    Result<void> set = session_->set_light(light);
    is_exposure_long_ = session_->exposure_us() * rate_hz_ > kMicrosecondsPerSecond;
    return set;
  }

  [[nodiscard]] SensorTotals counters() const override {
    return {.faults = {{"missed", sequence_.missed()}, {"incomplete", incomplete_}},
            .counts = {{"frames", frames_}, {"superseded", superseded_}}};
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    if (!is_exposure_long_) return std::nullopt;
    return kExposureTooLong;
  }

 private:
  bool is_whole(const v4l2_buffer& buffer) {
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused >= session_->frame_size())
      return true;
    ++incomplete_;
    return false;
  }

  /// The arrival: the kernel's stamp, if it is on our clock and plausible.
  [[nodiscard]] Timestamp arrival_of(const v4l2_buffer& buffer) const {
    const Timestamp now = clock_.now();
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      return now;
    const Timestamp stamped{std::chrono::seconds(buffer.timestamp.tv_sec) +
                            std::chrono::microseconds(buffer.timestamp.tv_usec)};
    return stamped <= now && now - stamped < std::chrono::seconds(1) ? stamped : now;
  }

  Frame frame_of(const v4l2_buffer& buffer) {
    const v4l2_pix_format& format = session_->format();
    const std::span<const std::uint8_t> memory = session_->memory(buffer.index);
    Frame frame{.stamp = arrival_of(buffer) - latency_,
                .camera = index_,
                .width = static_cast<int>(format.width),
                .height = static_cast<int>(format.height)};
    ++frames_;
    if (session_->bits() > 8) {
      frame.pixels = std::exchange(spare_, {});
      narrow_to_8_bits(memory, frame.width, frame.height, format.bytesperline, session_->bits(),
                       frame.pixels);
      session_->requeue(buffer.index);
      return frame;
    }
    frame.borrowed_stride = static_cast<std::ptrdiff_t>(format.bytesperline);
    frame.borrowed =
        BorrowedPixels(memory.data(), [session = session_, index = buffer.index](
                                          const std::uint8_t*) { session->requeue(index); });
    return frame;
  }

  std::shared_ptr<V4l2Session> session_;
  std::uint8_t index_;
  const Clock& clock_;
  Duration latency_;
  double rate_hz_;
  bool is_exposure_long_;
  FrameSequence sequence_;
  std::vector<std::uint8_t> spare_;
  std::uint64_t frames_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace

Result<std::unique_ptr<Camera>> open_v4l2_camera(const CameraConfig& config, std::uint8_t index,
                                                 const Clock& clock) {
  auto device = open_v4l2_device(config.device.id);
  if (!device) return tl::unexpected(std::move(device.error()));
  return start_v4l2_camera(std::move(*device), config, index, clock);
}

Result<std::unique_ptr<Camera>> start_v4l2_camera(std::unique_ptr<V4l2Device> device,
                                                  const CameraConfig& config, std::uint8_t index,
                                                  const Clock& clock) {
  auto session = std::make_shared<V4l2Session>(std::move(device), config.device.id);
  if (Result<void> started = session->start(config); !started)
    return tl::unexpected(started.error());
  return std::make_unique<V4l2Camera>(std::move(session), config, index, clock);
}

}  // namespace crepes
