#include "drivers/camera/aravis_camera.hpp"

#include <arv.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "drivers/camera/frame_sequence.hpp"
#include "drivers/device_clock.hpp"

namespace crepes {
namespace {

constexpr double kMicroseconds = 1e6;
constexpr int kBuffers =
    12;  // what is on its way, at 200 Hz within kRetention, and what is looked at
constexpr guint kRetention = 20'000;  // us that a frame waits for packets that were lost

struct Unref {
  void operator()(gpointer object) const { g_object_unref(object); }
};
template <class T>
using Object = std::unique_ptr<T, Unref>;

/// `call(GError**)`, with the error as ours: "what: why".
template <class Call>
auto attempt(const std::string& what, Call call) -> Result<std::invoke_result_t<Call, GError**>> {
  GError* error = nullptr;
  const auto told = [&] {
    const bool absent = g_error_matches(error, ARV_DEVICE_ERROR, ARV_DEVICE_ERROR_NOT_FOUND) != 0;
    std::string why = what + ": " + error->message;
    g_error_free(error);
    return fail(absent ? ErrorCode::kNotFound : ErrorCode::kIo, std::move(why));
  };
  if constexpr (std::is_void_v<std::invoke_result_t<Call, GError**>>) {
    call(&error);
    if (error != nullptr) return told();
    return {};
  } else {
    auto value = call(&error);
    if (error != nullptr) return told();
    return value;
  }
}

/// Whether the camera has a feature; one that cannot say so has not.
template <class Ask>
bool has(Ask ask, ArvCamera* camera) {
  return attempt("", [&](GError** e) { return ask(camera, e); }).value_or(0) != 0;
}

std::string text(const char* maybe) { return maybe != nullptr ? maybe : ""; }

std::string described(unsigned int i) {
  return text(arv_get_device_vendor(i)) + " " + text(arv_get_device_model(i)) + ", serial number " +
         text(arv_get_device_serial_nbr(i)) + ", " + text(arv_get_device_protocol(i)) + " at " +
         text(arv_get_device_address(i));
}

Result<std::string> the_only_camera() {
  const std::vector<FoundCamera> found = find_aravis_cameras();
  if (found.size() == 1) return found.front().device;
  if (found.empty()) return fail(ErrorCode::kNotFound, "no USB3 Vision or GigE Vision camera");
  std::string names;
  for (const FoundCamera& camera : found) names += (names.empty() ? "" : ", ") + camera.device;
  return fail(ErrorCode::kConfig, "several cameras: set device to one of " + names);
}

Result<void> set_pixel_format(ArvCamera* camera) {
  return attempt(
             "pixel format Mono8",
             [&](GError** e) { arv_camera_set_pixel_format(camera, ARV_PIXEL_FORMAT_MONO_8, e); })
      .map_error([&](Error error) {
        guint count = 0;
        const char** names =
            arv_camera_dup_available_pixel_formats_as_strings(camera, &count, nullptr);
        error.message += "; the camera offers";
        for (guint i = 0; i < count; ++i) error.message += std::string(" ") + names[i];
        g_free(names);
        return error;
      });
}

Result<void> set_region(ArvCamera* camera, const CameraConfig& config) {
  const int width = config.resolution[0];
  const int height = config.resolution[1];
  const int x = config.offset[0];
  const int y = config.offset[1];
  const auto described_as = [](int a, int b, int c, int d) {
    return "[" + std::to_string(a) + ", " + std::to_string(b) + "] at offset [" +
           std::to_string(c) + ", " + std::to_string(d) + "]";
  };
  const std::string wanted = "resolution " + described_as(width, height, x, y);
  int sensor_width = 0;
  int sensor_height = 0;
  int is_width = 0;
  int is_height = 0;
  int is_x = 0;
  int is_y = 0;
  const auto apply = [&](GError** e) {
    arv_camera_get_sensor_size(camera, &sensor_width, &sensor_height, e);
    if (*e == nullptr && x + width <= sensor_width && y + height <= sensor_height)
      arv_camera_set_region(camera, x, y, width, height, e);
    if (*e == nullptr) arv_camera_get_region(camera, &is_x, &is_y, &is_width, &is_height, e);
  };
  if (Result<void> applied = attempt(wanted, apply); !applied) return applied;
  if (is_x == x && is_y == y && is_width == width && is_height == height) return {};
  return fail(ErrorCode::kConfig, wanted + ": the camera, of " + std::to_string(sensor_width) +
                                      " x " + std::to_string(sensor_height) + " pixels, delivers " +
                                      described_as(is_width, is_height, is_x, is_y));
}

Result<void> set_trigger(ArvCamera* camera, const CameraConfig& config) {
  if (config.trigger == CameraTrigger::kHardware) {
    return attempt("trigger_source " + config.trigger_source, [&](GError** e) {
      arv_camera_set_trigger(camera, config.trigger_source.c_str(), e);
    });
  }
  static_cast<void>(
      attempt("", [&](GError** e) { arv_camera_clear_triggers(camera, e); }));  // may have none
  return attempt("rate_hz",
                 [&](GError** e) { arv_camera_set_frame_rate(camera, config.rate_hz, e); });
}

Result<void> set_light(ArvCamera* camera, const CameraConfig& config) {
  if (config.exposure_us) {
    const auto set = [&](GError** e) {
      if (has(arv_camera_is_exposure_auto_available, camera))
        arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, e);
      if (*e == nullptr) arv_camera_set_exposure_time(camera, *config.exposure_us, e);
    };
    if (Result<void> done = attempt("exposure_us", set); !done) return done;
  }
  if (!config.gain) return {};
  return attempt("gain", [&](GError** e) {
    if (has(arv_camera_is_gain_auto_available, camera))
      arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, e);
    if (*e == nullptr) arv_camera_set_gain(camera, *config.gain, e);
  });
}

Result<void> set_up(ArvCamera* camera, const CameraConfig& config) {
  // A program that crashed may have left it running.
  static_cast<void>(attempt("", [&](GError** e) { arv_camera_stop_acquisition(camera, e); }));
  return set_pixel_format(camera)
      .and_then([&] { return set_region(camera, config); })
      .and_then([&] {
        return attempt("acquisition mode", [&](GError** e) {
          arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, e);
        });
      })
      .and_then([&] { return set_trigger(camera, config); })
      .and_then([&] { return set_light(camera, config); });
}

bool is_network_stream(ArvStream* stream) { return ARV_IS_GV_STREAM(stream) != 0; }

/// What a packet socket would miss: it hears nothing on loopback.
bool is_loopback(ArvCamera* camera) {
  GSocketAddress* address =
      arv_gv_device_get_device_address(ARV_GV_DEVICE(arv_camera_get_device(camera)));
  return g_inet_address_get_is_loopback(
             g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(address))) != 0;
}

Result<void> set_packets(ArvCamera* camera, int packet_size) {
  if (arv_camera_is_gv_device(camera) == 0) return {};
  if (is_loopback(camera))
    arv_camera_gv_set_stream_options(camera, ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  if (packet_size == 0) return {};
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  return attempt("packet_size",
                 [&](GError** e) { arv_camera_gv_set_packet_size(camera, packet_size, e); });
}

/// A camera that runs. It lives as long as one of its buffers is away.
class Session {
 public:
  static Result<std::shared_ptr<Session>> open(const std::string& device,
                                               const CameraConfig& config) {
    return attempt(device, [&](GError** e) { return arv_camera_new(device.c_str(), e); })
        .and_then([&](ArvCamera* opened) -> Result<std::shared_ptr<Session>> {
          auto session = std::make_shared<Session>(opened);
          return set_up(opened, config)
              .and_then([&] { return set_packets(opened, config.packet_size); })
              .and_then([&] { return session->start(); })
              .map([&] { return session; });
        });
  }

  explicit Session(ArvCamera* opened) : camera_(opened) {
    g_signal_connect(arv_camera_get_device(opened), "control-lost",
                     G_CALLBACK(+[](ArvDevice*, gpointer lost) {
                       g_atomic_int_set(static_cast<gint*>(lost), 1);
                     }),
                     &lost_);
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  Session(Session&&) = delete;
  Session& operator=(Session&&) = delete;
  ~Session() {
    static_cast<void>(
        attempt("", [&](GError** e) { arv_camera_stop_acquisition(camera_.get(), e); }));
    stream_.reset();
    g_signal_handlers_disconnect_by_data(arv_camera_get_device(camera_.get()), &lost_);
  }

  [[nodiscard]] ArvCamera* camera() const { return camera_.get(); }
  [[nodiscard]] ArvStream* stream() const { return stream_.get(); }
  [[nodiscard]] bool is_lost() const { return g_atomic_int_get(&lost_) != 0; }

 private:
  Result<void> start() {
    const Result<guint> payload = attempt(
        "payload size", [&](GError** e) { return arv_camera_get_payload(camera_.get(), e); });
    if (!payload) return tl::unexpected(payload.error());
    const auto made = attempt("stream", [&](GError** e) {
      return arv_camera_create_stream(camera_.get(), nullptr, nullptr, e);
    });
    if (!made) return tl::unexpected(made.error());
    stream_.reset(*made);
    if (is_network_stream(stream_.get())) {
      // The kernel's default holds a tenth of a picture: packets would be lost. It cuts what it
      // does not allow, see net.core.rmem_max.
      const auto three_frames = static_cast<gint>(std::min<guint>(3 * *payload, 1U << 30U));
      g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED,
                   "socket-buffer-size", three_frames, "frame-retention", kRetention, nullptr);
    }
    for (int i = 0; i < kBuffers; ++i)
      arv_stream_push_buffer(stream_.get(), arv_buffer_new(*payload, nullptr));
    return attempt("start", [&](GError** e) { arv_camera_start_acquisition(camera_.get(), e); });
  }

  Object<ArvCamera> camera_;
  Object<ArvStream> stream_;
  gint lost_ = 0;  ///< set by a thread of Aravis
};

class AravisCamera final : public Camera {
 public:
  AravisCamera(std::shared_ptr<Session> session, std::string device, const CameraConfig& config,
               std::uint8_t index, const Clock& clock)
      : session_(std::move(session)),
        device_(std::move(device)),
        index_(index),
        clock_(clock),
        latency_(from_seconds(config.latency_ms * 1e-3)) {
    const double exposure_us = attempt("", [&](GError** e) {
                                 return arv_camera_get_exposure_time(session_->camera(), e);
                               }).value_or(0.0);
    is_exposure_long_ = exposure_us * config.rate_hz > kMicroseconds;
  }

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
    if (newest != nullptr) return lend(newest);
    if (session_->is_lost()) return fail(ErrorCode::kIo, device_ + ": the camera is gone");
    return std::optional<Frame>{};
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
    if (is_exposure_long_) return "the exposure is longer than a frame at rate_hz: set exposure_us";
    if (incomplete_share_ < kTooMany) return std::nullopt;
    return "one frame in " + std::to_string(std::lround(1.0 / incomplete_share_)) +
           " comes incomplete: packets get lost; use jumbo frames and packet_size 9000, raise "
           "net.core.rmem_max, or mend the cable";
  }

 private:
  [[nodiscard]] bool is_complete(ArvBuffer* buffer) {
    constexpr double kMemory = 0.02;
    const bool complete = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
    incomplete_share_ += kMemory * ((complete ? 0.0 : 1.0) - incomplete_share_);
    if (!complete) ++incomplete_;
    sequence_.note(arv_buffer_get_frame_id(buffer));
    return complete;
  }

  /// The buffer goes back to the stream when the frame ends.
  [[nodiscard]] Result<std::optional<Frame>> lend(ArvBuffer* buffer) {
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
    frame.lent_stride = std::ptrdiff_t{frame.width} + padding;
    frame.lent = LentPixels(static_cast<const std::uint8_t*>(data),
                            [session = session_, buffer](const std::uint8_t*) {
                              arv_stream_push_buffer(session->stream(), buffer);
                            });
    if (const ArvPixelFormat format = arv_buffer_get_image_pixel_format(buffer);
        format != ARV_PIXEL_FORMAT_MONO_8)
      return fail(ErrorCode::kFormat, device_ + ": frames in another pixel format than Mono8");
    if (static_cast<std::size_t>(frame.lent_stride) * static_cast<std::size_t>(frame.height) > size)
      return fail(ErrorCode::kFormat, device_ + ": frames shorter than they claim");
    ++frames_;
    return std::optional(std::move(frame));
  }

  std::shared_ptr<Session> session_;
  std::string device_;
  std::uint8_t index_;
  const Clock& clock_;
  Duration latency_;
  bool is_exposure_long_ = false;
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
  const Result<std::string> device = config.device.empty() ? the_only_camera() : config.device;
  if (!device) return tl::unexpected(device.error());
  Result<std::shared_ptr<Session>> session = Session::open(*device, config);
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
