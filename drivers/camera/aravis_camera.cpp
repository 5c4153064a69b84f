#include "drivers/camera/aravis_camera.hpp"

#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "drivers/camera/aravis_call.hpp"
#include "drivers/camera/aravis_settings.hpp"
#include "drivers/camera/frame_sequence.hpp"
#include "drivers/device_clock.hpp"

namespace crepes {
namespace {

constexpr double kMicroseconds = 1e6;
constexpr int kAravisBuffers =
    12;  // frames in transfer, at 200 Hz within kRetention, and frames in use
constexpr guint kRetention = 20'000;  // us that a frame waits for lost packets

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

bool is_network_stream(ArvStream* stream) { return ARV_IS_GV_STREAM(stream) != 0; }

std::string text(const char* maybe) { return maybe != nullptr ? maybe : ""; }

std::string described(unsigned int i) {
  return fmt::format("{} {}, serial number {}, {} at {}", text(arv_get_device_vendor(i)),
                     text(arv_get_device_model(i)), text(arv_get_device_serial_nbr(i)),
                     text(arv_get_device_protocol(i)), text(arv_get_device_address(i)));
}

Result<std::string> the_only_camera() {
  const std::vector<FoundCamera> found = find_aravis_cameras();
  if (found.size() == 1) return found.front().device;
  if (found.empty()) return fail(ErrorCode::kNotFound, "no USB3 Vision or GigE Vision camera");
  std::string names;
  for (const FoundCamera& camera : found) names += (names.empty() ? "" : ", ") + camera.device;
  return fail(ErrorCode::kConfig, fmt::format("several cameras: set device to one of {}", names));
}

/// A running camera. It lives until all of its buffers have been returned.
class AravisSession {
 public:
  static Result<std::shared_ptr<AravisSession>> open(const std::string& device,
                                                     const CameraConfig& config) {
    return call_aravis(device, [&](GError** e) { return arv_camera_new(device.c_str(), e); })
        .and_then([&](ArvCamera* opened) -> Result<std::shared_ptr<AravisSession>> {
          auto session = std::make_shared<AravisSession>(opened);
          return configure_aravis(opened, config)
              .and_then([&] { return session->start(); })
              .map([&] { return session; });
        });
  }

  explicit AravisSession(ArvCamera* opened) : camera_(opened) {
    g_signal_connect(arv_camera_get_device(opened), "control-lost",
                     G_CALLBACK(+[](ArvDevice*, gpointer lost) {
                       g_atomic_int_set(static_cast<gint*>(lost), 1);
                     }),
                     &lost_);
  }
  AravisSession(const AravisSession&) = delete;
  AravisSession& operator=(const AravisSession&) = delete;
  AravisSession(AravisSession&&) = delete;
  AravisSession& operator=(AravisSession&&) = delete;
  ~AravisSession() {
    static_cast<void>(
        call_aravis("", [&](GError** e) { arv_camera_stop_acquisition(camera_.get(), e); }));
    stream_.reset();
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &lost_);
  }

  [[nodiscard]] ArvCamera* camera() const { return camera_.get(); }
  [[nodiscard]] ArvStream* stream() const { return stream_.get(); }
  [[nodiscard]] bool is_lost() const { return g_atomic_int_get(&lost_) != 0; }

 private:
  Result<void> start() {
    const Result<guint> payload = call_aravis(
        "payload size", [&](GError** e) { return arv_camera_get_payload(camera_.get(), e); });
    if (!payload) return tl::unexpected(payload.error());
    const auto made = call_aravis("stream", [&](GError** e) {
      return arv_camera_create_stream(camera_.get(), nullptr, nullptr, e);
    });
    if (!made) return tl::unexpected(made.error());
    stream_.reset(*made);
    if (is_network_stream(stream_.get())) {
      // The kernel's default holds a tenth of an image: packets would be lost. The kernel limits
      // the size to net.core.rmem_max.
      const auto three_frames = static_cast<gint>(std::min<guint>(3 * *payload, 1U << 30U));
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", three_frames, "frame-retention", kRetention, nullptr);
    }
    for (int i = 0; i < kAravisBuffers; ++i)
      arv_stream_push_buffer(stream_.get(), arv_buffer_new(*payload, nullptr));
    return call_aravis("start",
                       [&](GError** e) { arv_camera_start_acquisition(camera_.get(), e); });
  }

  Object<ArvCamera> camera_;
  Object<ArvStream> stream_;
  gint lost_ = 0;  ///< set by a thread of Aravis
};

class AravisCamera final : public Camera {
 public:
  AravisCamera(std::shared_ptr<AravisSession> session, std::string device,
               const CameraConfig& config, std::uint8_t index, const Clock& clock)
      : session_(std::move(session)),
        device_(std::move(device)),
        index_(index),
        clock_(clock),
        latency_(from_seconds(config.device.latency_ms * 1e-3)),
        rate_hz_(config.calibration.rate_hz),
        is_exposure_long_(exposure_us() * rate_hz_ > kMicroseconds) {}

  [[nodiscard]] Result<std::optional<Frame>> read_once(std::chrono::milliseconds timeout) override {
    ArvStream* stream = session_->stream();
    const auto wait = static_cast<guint64>(std::chrono::microseconds(timeout).count());
    ArvBuffer* newest = nullptr;
    for (ArvBuffer* buffer = arv_stream_timeout_pop_buffer(stream, wait); buffer != nullptr;
         buffer = arv_stream_try_pop_buffer(stream)) {
      if (!is_complete(buffer)) {
        arv_stream_push_buffer(stream, buffer);
        continue;
      }
      if (newest != nullptr) {
        ++superseded_;
        arv_stream_push_buffer(stream, newest);
      }
      newest = buffer;
    }
    if (newest != nullptr) return borrow(newest);
    if (session_->is_lost())
      return fail(ErrorCode::kIo, fmt::format("{}: the camera is gone", device_));
    return std::optional<Frame>{};
  }

  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    Result<void> set = set_aravis_light(session_->camera(), light);
    is_exposure_long_ = exposure_us() * rate_hz_ > kMicroseconds;
    return set;
  }

  [[nodiscard]] SensorTotals counters() const override {
    ArvStream* stream = session_->stream();
    const auto of_aravis = [&](const char* name) {
      return std::uint64_t{arv_stream_get_info_uint64_by_name(stream, name)};
    };
    SensorTotals totals{.faults = {{"missed", sequence_.missed()},
                                   {"incomplete", incomplete_},
                                   {"clock_restarts", device_clock_.restarts()},
                                   {"underruns", of_aravis("n_underruns")}},
                        .counts = {{"frames", frames_}, {"superseded", superseded_}}};
    if (!is_network_stream(stream)) return totals;
    totals.faults.emplace_back("missing_packets", of_aravis("n_missing_packets"));
    totals.counts.emplace_back("resent_packets", of_aravis("n_resent_packets"));
    return totals;
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    constexpr double kTooMany = 0.05;
    if (is_exposure_long_) return kExposureTooLong;
    if (incomplete_share_ < kTooMany) return std::nullopt;
    return fmt::format(
        "one frame in {} comes incomplete: packets get lost; use jumbo frames and packet_size "
        "9000, raise net.core.rmem_max, or mend the cable",
        std::lround(1.0 / incomplete_share_));
  }

 private:
  /// The device's; 0 if it does not report one.
  [[nodiscard]] double exposure_us() const {
    return call_aravis(
               "", [&](GError** e) { return arv_camera_get_exposure_time(session_->camera(), e); })
        .value_or(0.0);
  }

  [[nodiscard]] bool is_complete(ArvBuffer* buffer) {
    constexpr double kMemory = 0.02;
    const bool complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    incomplete_share_ += kMemory * ((complete ? 0.0 : 1.0) - incomplete_share_);
    if (!complete) ++incomplete_;
    sequence_.add(arv_buffer_get_frame_id(buffer));
    return complete;
  }

  /// The frame's destructor returns the buffer to the stream.
  [[nodiscard]] Result<std::optional<Frame>> borrow(ArvBuffer* buffer) {
    const Timestamp arrival = clock_.now();
    std::size_t size = 0;
    const void* data = arv_buffer_get_image_data(buffer, &size);
    Frame frame{.camera = index_};
    std::optional<DeviceTime> taken;
    if (const guint64 ns = arv_buffer_get_timestamp(buffer); ns != 0) taken = DeviceTime{ns};
    frame.stamp = device_clock_.to_local(taken, arrival) - latency_;
    int padding = 0;
    int ignored = 0;
    arv_buffer_get_image_padding(buffer, &padding, &ignored);
    frame.width = arv_buffer_get_image_width(buffer);
    frame.height = arv_buffer_get_image_height(buffer);
    frame.borrowed_stride = std::ptrdiff_t{frame.width} + padding;
    frame.borrowed = BorrowedPixels(static_cast<const std::uint8_t*>(data),
                                    [session = session_, buffer](const std::uint8_t*) {
                                      arv_stream_push_buffer(session->stream(), buffer);
                                    });
    if (const ArvPixelFormat format = arv_buffer_get_image_pixel_format(buffer);
        format != ARV_PIXEL_FORMAT_MONO_8) {
      return fail(ErrorCode::kFormat,
                  fmt::format("{}: frames in another pixel format than Mono8", device_));
    }
    if (static_cast<std::size_t>(frame.borrowed_stride) * static_cast<std::size_t>(frame.height) >
        size)
      return fail(ErrorCode::kFormat, fmt::format("{}: frames shorter than they claim", device_));
    ++frames_;
    return std::optional(std::move(frame));
  }

  std::shared_ptr<AravisSession> session_;
  std::string device_;
  std::uint8_t index_;
  const Clock& clock_;
  Duration latency_;
  double rate_hz_;
  bool is_exposure_long_;
  DeviceClock device_clock_;
  FrameSequence sequence_;
  std::uint64_t frames_ = 0;
  std::uint64_t incomplete_ = 0;
  std::uint64_t superseded_ = 0;
  double incomplete_share_ = 0.0;  ///< of the last fifty or so
};

}  // namespace

Result<std::unique_ptr<Camera>> open_aravis_camera(const CameraConfig& config, std::uint8_t index,
                                                   const Clock& clock) {
  const Result<std::string> device =
      config.device.id.empty() ? the_only_camera() : config.device.id;
  if (!device) return tl::unexpected(device.error());
  Result<std::shared_ptr<AravisSession>> session = AravisSession::open(*device, config);
  if (!session) return tl::unexpected(session.error());
  return std::make_unique<AravisCamera>(std::move(*session), *device, config, index, clock);
}

std::vector<FoundCamera> find_aravis_cameras() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned int i = 0; i < arv_get_n_devices(); ++i)
    found.push_back({text(arv_get_device_id(i)), described(i)});
  return found;
}

}  // namespace crepes
