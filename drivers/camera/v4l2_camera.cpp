#include "drivers/camera/v4l2_camera.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string_view>
#include <system_error>
#include <utility>

#include "drivers/camera/frame_sequence.hpp"
#include "drivers/camera/grey_conversion.hpp"

namespace crepes {
namespace {

constexpr std::uint32_t kCapture = V4L2_BUF_TYPE_VIDEO_CAPTURE;
constexpr std::uint32_t kBuffers = 8;
constexpr double kExposureUnit = 100.0;  // us, of V4L2_CID_EXPOSURE_ABSOLUTE

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

tl::unexpected<Error> refusal(const std::string& what, int error) {
  return fail(ErrorCode::kIo, what + ": " + std::generic_category().message(error));
}

/// A device that runs. It lives as long as one of its buffers is away.
class Session {
 public:
  Session(std::unique_ptr<V4l2Device> device, std::string name)
      : device_(std::move(device)), name_(std::move(name)) {}

  Result<void> start(const CameraConfig& config) {
    return check_abilities()
        .and_then([&] { return set_region(config); })
        .and_then([&] { return set_format(config); })
        .and_then([&] { return set_rate(config.rate_hz); })
        .and_then([&] { return set_light(config); })
        .and_then([&] { return run(); });
  }

  [[nodiscard]] bool wait(std::chrono::milliseconds timeout) { return device_->wait(timeout); }

  /// A buffer with a frame; none when none is there.
  Result<std::optional<v4l2_buffer>> fetch() {
    v4l2_buffer buffer = empty_buffer(0);
    const int error = device_->request(VIDIOC_DQBUF, &buffer);
    if (error == EAGAIN) return std::optional<v4l2_buffer>{};
    if (error != 0) return refusal(name_ + ": the camera is gone", error);
    if (buffer.index >= buffers_.size())
      return fail(ErrorCode::kIo, name_ + ": a buffer that does not exist");
    return std::optional(buffer);
  }
  /// Lets the device fill the buffer anew. Where it does not, the next fetch says why.
  void give_back(std::uint32_t index) {
    v4l2_buffer buffer = empty_buffer(index);
    static_cast<void>(device_->request(VIDIOC_QBUF, &buffer));
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
  /// What the device says of its exposure; 0 where it says nothing.
  [[nodiscard]] double exposure_us() {
    v4l2_control control{.id = V4L2_CID_EXPOSURE_ABSOLUTE, .value = 0};
    return device_->request(VIDIOC_G_CTRL, &control) == 0 ? kExposureUnit * control.value : 0.0;
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
    if (const int error = device_->request(VIDIOC_QUERYCAP, &ability); error != 0)
      return refusal(name_ + ": no video device", error);
    constexpr std::uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    const std::uint32_t able = (ability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                   ? ability.device_caps
                                   : ability.capabilities;
    if ((able & kNeeded) == kNeeded) return {};
    return fail(ErrorCode::kConfig, name_ + ": a video device that captures no frames");
  }

  Result<void> set_region(const CameraConfig& config) {
    if (config.offset == std::array{0, 0}) return {};
    v4l2_selection region{};
    region.type = kCapture;
    region.target = V4L2_SEL_TGT_CROP;
    region.r = {config.offset[0], config.offset[1],
                static_cast<std::uint32_t>(config.resolution[0]),
                static_cast<std::uint32_t>(config.resolution[1])};
    const v4l2_rect wanted = region.r;
    if (const int error = device_->request(VIDIOC_S_SELECTION, &region); error != 0)
      return refusal(name_ + ": offset", error);
    if (region.r.left == wanted.left && region.r.top == wanted.top) return {};
    return fail(ErrorCode::kConfig, name_ + ": offset: the device takes [" +
                                        std::to_string(region.r.left) + ", " +
                                        std::to_string(region.r.top) + "] instead");
  }

  Result<void> set_format(const CameraConfig& config) {
    std::string offers;
    for (const GreyFormat& wanted : kFormats) {
      v4l2_format format{};
      format.type = kCapture;
      format.fmt.pix.width = static_cast<std::uint32_t>(config.resolution[0]);
      format.fmt.pix.height = static_cast<std::uint32_t>(config.resolution[1]);
      format.fmt.pix.pixelformat = wanted.code;
      format.fmt.pix.field = V4L2_FIELD_NONE;
      const int error = device_->request(VIDIOC_S_FMT, &format);
      if (error == EBUSY) return refusal(name_, error);
      if (error != 0) continue;
      format_ = format.fmt.pix;
      bits_ = wanted.bits;
      if (is_as(config, wanted)) return {};
      offers = name_of(format_.pixelformat) + " of [" + std::to_string(format_.width) + ", " +
               std::to_string(format_.height) + "]";
      if (format_.pixelformat == wanted.code) break;  // grey, in another size
    }
    return fail(ErrorCode::kConfig, name_ + ": no GREY, Y16, Y12 or Y10 of [" +
                                        std::to_string(config.resolution[0]) + ", " +
                                        std::to_string(config.resolution[1]) + "]" +
                                        (offers.empty() ? "" : "; the device offers " + offers));
  }

  [[nodiscard]] bool is_as(const CameraConfig& config, const GreyFormat& wanted) const {
    const std::uint32_t bytes = wanted.bits > 8 ? 2 : 1;
    return format_.pixelformat == wanted.code &&
           format_.width == static_cast<std::uint32_t>(config.resolution[0]) &&
           format_.height == static_cast<std::uint32_t>(config.resolution[1]) &&
           format_.bytesperline >= bytes * format_.width;
  }

  Result<void> set_rate(double rate_hz) {
    constexpr std::uint32_t kMilli = 1000;
    v4l2_streamparm parameters{};
    parameters.type = kCapture;
    parameters.parm.capture.timeperframe = {
        kMilli, static_cast<std::uint32_t>(std::lround(rate_hz * kMilli))};
    const int error = device_->request(VIDIOC_S_PARM, &parameters);
    if (error == 0 || error == ENOTTY || error == EINVAL) return {};  // a fixed rate shows itself
    return refusal(name_ + ": rate_hz", error);
  }

  Result<void> set_light(const CameraConfig& config) {
    if (config.exposure_us) {
      static_cast<void>(set(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL));  // may have none
      const auto units = std::max(1L, std::lround(*config.exposure_us / kExposureUnit));
      if (const int error = set(V4L2_CID_EXPOSURE_ABSOLUTE, static_cast<int>(units)); error != 0)
        return refusal(name_ + ": exposure_us", error);
    }
    if (!config.gain) return {};
    static_cast<void>(set(V4L2_CID_AUTOGAIN, 0));  // may have none
    const int error = set(V4L2_CID_GAIN, static_cast<int>(std::lround(*config.gain)));
    return error == 0 ? Result<void>{} : refusal(name_ + ": gain", error);
  }

  int set(std::uint32_t id, int value) {
    v4l2_control control{.id = id, .value = value};
    return device_->request(VIDIOC_S_CTRL, &control);
  }

  Result<void> run() {
    v4l2_requestbuffers wanted{};
    wanted.count = kBuffers;
    wanted.type = kCapture;
    wanted.memory = V4L2_MEMORY_MMAP;
    if (const int error = device_->request(VIDIOC_REQBUFS, &wanted); error != 0)
      return refusal(name_ + ": buffers", error);
    for (std::uint32_t i = 0; i < wanted.count; ++i) {
      v4l2_buffer buffer = empty_buffer(i);
      if (const int error = device_->request(VIDIOC_QUERYBUF, &buffer); error != 0)
        return refusal(name_ + ": buffers", error);
      buffers_.push_back(device_->map(buffer.length, buffer.m.offset));
      if (buffers_.back().size() < frame_size())
        return fail(ErrorCode::kIo, name_ + ": buffers that hold no frame");
      give_back(i);
    }
    std::uint32_t type = kCapture;
    const int error = device_->request(VIDIOC_STREAMON, &type);
    return error == 0 ? Result<void>{} : refusal(name_ + ": start", error);
  }

  std::unique_ptr<V4l2Device> device_;  // closing it stops the stream
  std::string name_;
  v4l2_pix_format format_{};
  int bits_ = 8;
  std::vector<std::span<const std::uint8_t>> buffers_;
};

class V4l2Camera final : public Camera {
 public:
  V4l2Camera(std::shared_ptr<Session> session, const CameraConfig& config, std::uint8_t index,
             const Clock& clock)
      : session_(std::move(session)),
        index_(index),
        clock_(clock),
        latency_(from_seconds(config.latency_ms * 1e-3)),
        is_exposure_long_(session_->exposure_us() * config.rate_hz > 1e6) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override {
    if (!session_->wait(timeout)) return std::optional<Frame>{};
    std::optional<v4l2_buffer> newest;
    for (;;) {
      const Result<std::optional<v4l2_buffer>> next = session_->fetch();
      if (!next) return tl::unexpected(next.error());
      if (!*next) break;
      sequence_.note((*next)->sequence);
      if (!is_whole(**next)) {
        session_->give_back((*next)->index);
        continue;
      }
      if (newest) {
        ++superseded_;
        session_->give_back(newest->index);
      }
      newest = *next;
    }
    if (!newest) return std::optional<Frame>{};
    return std::optional(frame_of(*newest));
  }

  void recycle(Frame frame) override {
    if (spare_.empty()) spare_ = std::move(frame.pixels);
  }

  [[nodiscard]] SensorTotals counters() const override {
    return {.faults = {{"missed", sequence_.missed()}, {"incomplete", incomplete_}},
            .counts = {{"frames", frames_}, {"superseded", superseded_}}};
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    if (!is_exposure_long_) return std::nullopt;
    return "the exposure is longer than a frame at rate_hz: set exposure_us";
  }

 private:
  bool is_whole(const v4l2_buffer& buffer) {
    if ((buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused >= session_->frame_size())
      return true;
    ++incomplete_;
    return false;
  }

  /// When it was there: as the kernel says, if by our clock and plausible.
  [[nodiscard]] Timestamp arrival_of(const v4l2_buffer& buffer) const {
    const Timestamp now = clock_.now();
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      return now;
    const Timestamp told{std::chrono::seconds(buffer.timestamp.tv_sec) +
                         std::chrono::microseconds(buffer.timestamp.tv_usec)};
    return told <= now && now - told < std::chrono::seconds(1) ? told : now;
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
      session_->give_back(buffer.index);
      return frame;
    }
    frame.lent_stride = static_cast<std::ptrdiff_t>(format.bytesperline);
    frame.lent = LentPixels(memory.data(), [session = session_, index = buffer.index](
                                               const std::uint8_t*) { session->give_back(index); });
    return frame;
  }

  std::shared_ptr<Session> session_;
  std::uint8_t index_;
  const Clock& clock_;
  Duration latency_;
  bool is_exposure_long_;
  FrameSequence sequence_;
  std::vector<std::uint8_t> spare_;
  std::uint64_t frames_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace

Result<std::unique_ptr<Camera>> run_v4l2_camera(std::unique_ptr<V4l2Device> device,
                                                const CameraConfig& config, std::uint8_t index,
                                                const Clock& clock) {
  auto session = std::make_shared<Session>(std::move(device), config.device);
  if (Result<void> started = session->start(config); !started)
    return tl::unexpected(started.error());
  return std::make_unique<V4l2Camera>(std::move(session), config, index, clock);
}

}  // namespace crepes
