#include "drivers/camera/mindvision_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/camera/mindvision_library.hpp"
#include "drivers/device_clock.hpp"

namespace crepes {
namespace {

constexpr int kEnglish = 0;
constexpr int kAsItIs = -1;
constexpr int kFreeRunning = 0;
constexpr int kHardwareTrigger = 2;

Result<void> check(int code, const std::string& what) {
  if (code == 0) return {};
  return fail(ErrorCode::kIo, fmt::format("{}: the library's error {}", what, code));
}

std::string serial_of(const MindVisionDevice& device) {
  const auto& text = device.serial_number;
  return {text.begin(), std::find(text.begin(), text.end(), '\0')};
}

/// The requested camera among the connected ones.
Result<MindVisionDevice> find_device(const MindVisionLibrary& library, const std::string& serial) {
  std::vector<MindVisionDevice> devices(16);
  auto count = static_cast<int>(devices.size());
  if (Result<void> asked = check(library.enumerate(devices.data(), &count), "no camera found");
      !asked) {
    asked.error().code = ErrorCode::kNotFound;
    return tl::unexpected(asked.error());
  }
  devices.resize(static_cast<std::size_t>(std::clamp(count, 0, 16)));
  if (devices.empty()) return fail(ErrorCode::kNotFound, "no MindVision camera");
  if (serial.empty() && devices.size() == 1) return devices.front();
  const auto found = std::ranges::find(devices, serial, serial_of);
  if (found != devices.end() && !serial.empty()) return *found;
  std::string names;
  for (const auto& device : devices) names += (names.empty() ? "" : ", ") + serial_of(device);
  return serial.empty() ? fail(ErrorCode::kConfig,
                               fmt::format("several cameras: set device to one of {}", names))
                        : fail(ErrorCode::kNotFound,
                               fmt::format("{}: no such camera; there is {}", serial, names));
}

/// A running camera. It lives until all of its buffers have been returned.
class MindVisionSession {
 public:
  MindVisionSession(const MindVisionLibrary& library, int handle)
      : library_(library), handle_(handle) {}
  MindVisionSession(const MindVisionSession&) = delete;
  MindVisionSession& operator=(const MindVisionSession&) = delete;
  MindVisionSession(MindVisionSession&&) = delete;
  MindVisionSession& operator=(MindVisionSession&&) = delete;
  ~MindVisionSession() { library_.close(handle_); }

  static Result<std::shared_ptr<MindVisionSession>> open(const MindVisionLibrary& library,
                                                         MindVisionDevice device,
                                                         const CameraConfig& config) {
    int handle = 0;
    if (Result<void> done = check(library.open(&device, kAsItIs, kAsItIs, &handle),
                                  fmt::format("camera {}", serial_of(device)));
        !done)
      return tl::unexpected(done.error());
    auto session = std::make_shared<MindVisionSession>(library, handle);
    return session->set_up(config).map([&] { return session; });
  }

  int get_frame(MindVisionFrame& frame, std::uint8_t*& pixels, std::uint32_t timeout_ms) const {
    return library_.get_frame(handle_, &frame, &pixels, timeout_ms);
  }
  void release_frame(std::uint8_t* pixels) const { library_.release_frame(handle_, pixels); }

  [[nodiscard]] Result<void> set_light(const CameraLight& light) const {
    if (!light.exposure_us) return {};
    return check(library_.set_auto_exposure(handle_, 0), "exposure_us").and_then([&] {
      return check(library_.set_exposure_us(handle_, *light.exposure_us), "exposure_us");
    });
  }

 private:
  [[nodiscard]] Result<void> set_up(const CameraConfig& config) const {
    const bool free = config.device.trigger == CameraTrigger::kFree;
    return check(library_.set_trigger_mode(handle_, free ? kFreeRunning : kHardwareTrigger),
                 "trigger")
        .and_then([&]() -> Result<void> {
          if (!free) return {};
          const auto rate_hz = static_cast<int>(std::lround(config.calibration.rate_hz));
          return check(library_.set_frame_rate(handle_, rate_hz), "rate_hz");
        })
        .and_then([&] { return set_light(config.device.light); })
        .and_then([&] { return check(library_.play(handle_), "start"); });
  }

  MindVisionLibrary library_;
  int handle_;
};

class MindVisionCamera final : public Camera {
 public:
  MindVisionCamera(std::shared_ptr<MindVisionSession> session, const CameraConfig& config,
                   std::uint8_t index, const Clock& clock)
      : session_(std::move(session)),
        index_(index),
        clock_(clock),
        latency_(from_seconds(config.device.latency_ms * 1e-3)),
        period_us_(1e6 / config.calibration.rate_hz) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override {
    std::optional<Frame> newest;
    for (auto wait = timeout;; wait = std::chrono::milliseconds::zero()) {
      Result<std::optional<Frame>> next = read_next(wait);
      if (!next) return next;
      if (!*next) return newest;
      if (newest) ++superseded_;
      newest = std::move(*next);
    }
  }

  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    return session_->set_light(light);
  }

  [[nodiscard]] SensorTotals counters() const override {
    return {.faults = {{"incomplete", incomplete_}, {"clock_restarts", device_clock_.restarts()}},
            .counts = {{"frames", frames_}, {"superseded", superseded_}}};
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    if (!is_exposure_long_) return std::nullopt;
    return kExposureTooLong;
  }

 private:
  [[nodiscard]] Result<std::optional<Frame>> read_next(std::chrono::milliseconds timeout) {
    MindVisionFrame head{};
    std::uint8_t* pixels = nullptr;
    const int code = session_->get_frame(head, pixels, static_cast<std::uint32_t>(timeout.count()));
    if (code == MindVisionLibrary::kTimeOut) return std::optional<Frame>{};
    if (code == MindVisionLibrary::kLostData) {
      ++incomplete_;
      return std::optional<Frame>{};
    }
    if (Result<void> read = check(code, "the camera is gone"); !read)
      return tl::unexpected(read.error());
    Frame frame{.camera = index_, .width = head.width, .height = head.height};
    frame.borrowed = BorrowedPixels(pixels, [session = session_, pixels](const std::uint8_t*) {
      session->release_frame(pixels);
    });
    frame.borrowed_stride = head.width;
    if (head.media_type != MindVisionLibrary::kMono8) {
      return fail(ErrorCode::kFormat, fmt::format("frames of media type {} instead of MONO8, {}",
                                                  head.media_type, MindVisionLibrary::kMono8));
    }
    if (head.width <= 0 || head.height <= 0 ||
        std::int64_t{head.width} * head.height > std::int64_t{head.bytes})
      return fail(ErrorCode::kFormat, "frames shorter than they claim");
    frame.stamp =
        device_clock_.to_local(
            DeviceTime::ticks(head.timestamp, std::chrono::microseconds(100), 32), clock_.now()) -
        latency_;
    is_exposure_long_ = head.exposure_us > period_us_;
    ++frames_;
    return std::optional(std::move(frame));
  }

  std::shared_ptr<MindVisionSession> session_;
  std::uint8_t index_;
  const Clock& clock_;
  Duration latency_;
  double period_us_;
  DeviceClock device_clock_;
  bool is_exposure_long_ = false;
  std::uint64_t frames_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t superseded_ = 0;
};

}  // namespace

Result<std::unique_ptr<Camera>> open_mindvision_camera(const CameraConfig& config,
                                                       std::uint8_t index, const Clock& clock) {
  const Result<MindVisionLibrary> library = MindVisionLibrary::load(config.device.library);
  if (!library) return tl::unexpected(library.error());
  Result<std::shared_ptr<MindVisionSession>> session =
      check(library->init(kEnglish), "CameraSdkInit")
          .and_then([&] { return find_device(*library, config.device.id); })
          .and_then([&](const MindVisionDevice& device) {
            return MindVisionSession::open(*library, device, config);
          });
  if (!session) return tl::unexpected(session.error());
  return std::make_unique<MindVisionCamera>(std::move(*session), config, index, clock);
}

}  // namespace crepes
