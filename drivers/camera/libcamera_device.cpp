#include "drivers/camera/libcamera_device.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <libcamera/libcamera.h>
#include <linux/dma-buf.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "drivers/base/unique_fd.hpp"

namespace crepes {
namespace {

namespace lc = libcamera;

constexpr unsigned kBuffers = 6;

tl::unexpected<Error> refusal(const std::string& what, int negative_errno) {
  return fail(ErrorCode::kIo,
              fmt::format("{}: {}", what, std::generic_category().message(-negative_errno)));
}

/// libcamera allows one manager a process. It starts with the first use and lasts until the end.
Result<lc::CameraManager*> manager() {
  static lc::CameraManager all;
  static const int started = all.start();
  if (started < 0) return refusal("libcamera", started);
  return &all;
}

std::string model_of(const lc::Camera& camera) {
  return camera.properties().get(lc::properties::Model).value_or(std::string("camera"));
}

/// The camera with this id, or the only one.
Result<std::shared_ptr<lc::Camera>> find_camera(const std::string& id) {
  const Result<lc::CameraManager*> all = manager();
  if (!all) return tl::unexpected(all.error());
  const std::vector<std::shared_ptr<lc::Camera>> cameras = (*all)->cameras();
  if (cameras.empty()) return fail(ErrorCode::kNotFound, "libcamera finds no camera");
  if (id.empty() && cameras.size() == 1) return cameras.front();
  std::string names;
  for (const auto& camera : cameras) {
    if (camera->id() == id) return camera;
    names += (names.empty() ? "" : ", ") + camera->id();
  }
  return id.empty() ? fail(ErrorCode::kConfig,
                           fmt::format("several cameras: set device to one of {}", names))
                    : fail(ErrorCode::kNotFound,
                           fmt::format("{}: no such camera; there is {}", id, names));
}

/// The pages of a buffer's first plane.
class MappedPlane {
 public:
  MappedPlane() = default;
  explicit MappedPlane(const lc::FrameBuffer::Plane& plane)
      : fd_(plane.fd.get()), offset_(plane.offset), length_(plane.length + plane.offset) {
    start_ = ::mmap(nullptr, length_, PROT_READ, MAP_SHARED, fd_, 0);
    if (start_ == MAP_FAILED) start_ = nullptr;
  }
  MappedPlane(MappedPlane&& other) noexcept
      : start_(std::exchange(other.start_, nullptr)),
        fd_(other.fd_),
        offset_(other.offset_),
        length_(other.length_) {}
  MappedPlane& operator=(MappedPlane&&) = delete;
  MappedPlane(const MappedPlane&) = delete;
  MappedPlane& operator=(const MappedPlane&) = delete;
  ~MappedPlane() {
    if (start_ != nullptr) ::munmap(start_, length_);
  }

  [[nodiscard]] std::span<const std::uint8_t> rows() const {
    if (start_ == nullptr) return {};
    return std::span(static_cast<const std::uint8_t*>(start_), length_).subspan(offset_);
  }
  /// Tells the kernel when the processor reads, so that its caches agree with the device.
  void sync(std::uint64_t edge) const {
    dma_buf_sync request{.flags = edge | DMA_BUF_SYNC_READ};
    static_cast<void>(::ioctl(fd_, DMA_BUF_IOCTL_SYNC, &request));  // other memory needs none
  }

 private:
  void* start_ = nullptr;
  int fd_ = -1;
  std::size_t offset_ = 0;
  std::size_t length_ = 0;
};

/// Values on their way from other threads to ours. A value is written as a whole or not at all;
/// there are fewer buffers than values fit into a pipe.
template <class T>
class Pipe {
 public:
  Pipe() {
    std::array<int, 2> ends{-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return;
    out_ = UniqueFd(ends[0]);
    in_ = UniqueFd(ends[1]);
  }
  [[nodiscard]] bool is_open() const { return static_cast<bool>(in_); }
  void push(T value) const { static_cast<void>(::write(in_.get(), &value, sizeof value)); }
  [[nodiscard]] std::optional<T> pop(std::chrono::milliseconds timeout) const {
    pollfd waiting{.fd = out_.get(), .events = POLLIN, .revents = 0};
    T value{};
    if (::poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0 ||
        ::read(out_.get(), &value, sizeof value) != sizeof value)
      return std::nullopt;
    return value;
  }

 private:
  UniqueFd out_;
  UniqueFd in_;
};

class RunningCamera final : public LibcameraDevice {
 public:
  explicit RunningCamera(std::shared_ptr<lc::Camera> camera)
      : camera_(std::move(camera)), allocator_(camera_) {}
  RunningCamera(const RunningCamera&) = delete;
  RunningCamera& operator=(const RunningCamera&) = delete;
  RunningCamera(RunningCamera&&) = delete;
  RunningCamera& operator=(RunningCamera&&) = delete;
  ~RunningCamera() override {
    if (is_running_) camera_->stop();
    camera_->requestCompleted.disconnect(this);
    camera_->disconnected.disconnect(this);
    mapped_.clear();
    if (stream_of_camera_ != nullptr) allocator_.free(stream_of_camera_);
    if (is_acquired_) camera_->release();
  }

  Result<void> start(const CameraConfig& config) {
    if (!completed_.is_open() || !returned_.is_open()) return fail(ErrorCode::kIo, "no pipe");
    if (const int code = camera_->acquire(); code < 0) return refusal(camera_->id(), code);
    is_acquired_ = true;
    return configure(config).and_then([&] { return allocate(); }).and_then([&] {
      return run(config);
    });
  }

  [[nodiscard]] const LibcameraStream& stream() const override { return stream_; }

  [[nodiscard]] std::span<const std::uint8_t> memory(std::uint32_t buffer) const override {
    return mapped_[buffer].rows();
  }

  [[nodiscard]] Result<std::optional<LibcameraFrame>> next(
      std::chrono::milliseconds timeout) override {
    while (const auto buffer = returned_.pop(std::chrono::milliseconds::zero())) queue(*buffer);
    const std::optional<lc::Request*> completed = completed_.pop(timeout);
    if (!completed) return std::optional<LibcameraFrame>{};
    lc::Request* const request = *completed;
    if (request == nullptr || request->status() == lc::Request::RequestCancelled)
      return fail(ErrorCode::kIo, fmt::format("{}: the camera is gone", camera_->id()));
    const auto buffer = static_cast<std::uint32_t>(request->cookie());
    mapped_[buffer].sync(DMA_BUF_SYNC_START);
    const lc::FrameMetadata& metadata = request->buffers().begin()->second->metadata();
    LibcameraFrame frame{.buffer = buffer,
                         .sequence = metadata.sequence,
                         .is_whole = metadata.status == lc::FrameMetadata::FrameSuccess,
                         .sensor_ns = std::nullopt};
    if (const auto stamp = request->metadata().get(lc::controls::SensorTimestamp))
      frame.sensor_ns = static_cast<std::uint64_t>(*stamp);
    frame.exposure_us = request->metadata().get(lc::controls::ExposureTime).value_or(0);
    return std::optional(frame);
  }

  void requeue(std::uint32_t buffer) override { returned_.push(buffer); }

  [[nodiscard]] Result<void> set_light(const CameraLight& light) override {
    if (light.exposure_us && !has(lc::controls::ExposureTime))
      return fail(ErrorCode::kConfig, camera_->id() + ": exposure_us: the camera sets none");
    if (light.gain && !has(lc::controls::AnalogueGain))
      return fail(ErrorCode::kConfig, camera_->id() + ": gain: the camera sets none");
    light_ = light;
    return {};
  }

 private:
  [[nodiscard]] bool has(const lc::ControlId& control) const {
    return camera_->controls().find(control.id()) != camera_->controls().end();
  }

  void queue(std::uint32_t buffer) {
    mapped_[buffer].sync(DMA_BUF_SYNC_END);
    lc::Request& request = *requests_[buffer];
    request.reuse(lc::Request::ReuseBuffers);
    apply_light(request.controls());
    static_cast<void>(camera_->queueRequest(&request));  // refused: the camera is gone
  }

  /// The first grey layout that the camera delivers in the wanted size.
  Result<void> configure(const CameraConfig& config) {
    const auto width = static_cast<unsigned>(config.calibration.resolution[0]);
    const auto height = static_cast<unsigned>(config.calibration.resolution[1]);
    std::string offers;
    for (const GreyLayout& layout : kGreyLayouts) {
      const auto role = layout.is_raw ? lc::StreamRole::Raw : lc::StreamRole::Viewfinder;
      std::unique_ptr<lc::CameraConfiguration> wanted = camera_->generateConfiguration({role});
      if (!wanted || wanted->empty()) continue;
      lc::StreamConfiguration& stream = wanted->at(0);
      stream.pixelFormat = lc::PixelFormat::fromString(std::string(layout.name));
      stream.size = {width, height};
      stream.bufferCount = kBuffers;
      const auto format = stream.pixelFormat;
      if (!format.isValid() || wanted->validate() == lc::CameraConfiguration::Invalid) continue;
      if (stream.pixelFormat != format || stream.size != lc::Size(width, height)) {
        offers = "; the camera offers " + stream.toString();
        continue;
      }
      if (const int code = camera_->configure(wanted.get()); code < 0)
        return refusal(camera_->id(), code);
      stream_ = {layout, static_cast<int>(width), static_cast<int>(height), stream.stride};
      stream_of_camera_ = stream.stream();
      return {};
    }
    return fail(ErrorCode::kConfig, fmt::format("{}: no grey levels of [{}, {}]{}", camera_->id(),
                                                width, height, offers));
  }

  Result<void> allocate() {
    if (const int code = allocator_.allocate(stream_of_camera_); code < 0)
      return refusal(camera_->id() + ": buffers", code);
    const std::size_t needed = stream_.stride * static_cast<std::size_t>(stream_.height - 1) +
                               stream_.layout.row_bytes(stream_.width);
    for (const auto& buffer : allocator_.buffers(stream_of_camera_)) {
      mapped_.emplace_back(buffer->planes().front());
      if (mapped_.back().rows().size() < needed)
        return fail(ErrorCode::kIo, camera_->id() + ": buffers that hold no frame");
      requests_.push_back(camera_->createRequest(requests_.size()));
      if (!requests_.back() || requests_.back()->addBuffer(stream_of_camera_, buffer.get()) < 0)
        return fail(ErrorCode::kIo, camera_->id() + ": no request");
    }
    return {};
  }

  Result<void> run(const CameraConfig& config) {
    if (Result<void> set = set_light(config.device.light); !set) return set;
    camera_->requestCompleted.connect(this, &RunningCamera::on_completed);
    camera_->disconnected.connect(this, &RunningCamera::on_disconnected);
    lc::ControlList first(camera_->controls());
    if (has(lc::controls::FrameDurationLimits)) {
      const auto period_us = static_cast<std::int64_t>(1e6 / config.calibration.rate_hz);
      first.set(lc::controls::FrameDurationLimits,
                lc::Span<const std::int64_t, 2>({period_us, period_us}));
    }
    apply_light(first);
    if (const int code = camera_->start(&first); code < 0) return refusal(camera_->id(), code);
    is_running_ = true;
    for (const auto& request : requests_) {
      if (const int code = camera_->queueRequest(request.get()); code < 0)
        return refusal(camera_->id(), code);
    }
    return {};
  }

  void apply_light(lc::ControlList& controls) const {
    if (light_.exposure_us) {
      if (has(lc::controls::AeEnable)) controls.set(lc::controls::AeEnable, false);
      controls.set(lc::controls::ExposureTime,
                   static_cast<std::int32_t>(std::lround(*light_.exposure_us)));
    }
    if (light_.gain) controls.set(lc::controls::AnalogueGain, static_cast<float>(*light_.gain));
  }

  void on_completed(lc::Request* request) { completed_.push(request); }
  void on_disconnected() { completed_.push(nullptr); }

  std::shared_ptr<lc::Camera> camera_;
  lc::FrameBufferAllocator allocator_;
  Pipe<lc::Request*> completed_;  // from libcamera's thread; null: the camera is gone
  Pipe<std::uint32_t> returned_;  // from the threads that were done with a frame
  LibcameraStream stream_;
  lc::Stream* stream_of_camera_ = nullptr;
  std::vector<MappedPlane> mapped_;
  std::vector<std::unique_ptr<lc::Request>> requests_;
  CameraLight light_;
  bool is_acquired_ = false;
  bool is_running_ = false;
};

}  // namespace

Result<std::unique_ptr<LibcameraDevice>> open_libcamera_device(const CameraConfig& config) {
  Result<std::shared_ptr<lc::Camera>> camera = find_camera(config.device.id);
  if (!camera) return tl::unexpected(camera.error());
  auto device = std::make_unique<RunningCamera>(std::move(*camera));
  if (Result<void> started = device->start(config); !started)
    return tl::unexpected(started.error());
  return device;
}

std::vector<FoundCamera> find_libcamera_cameras() {
  const Result<lc::CameraManager*> all = manager();
  if (!all) return {};
  std::vector<FoundCamera> found;
  for (const auto& camera : (*all)->cameras()) found.push_back({camera->id(), model_of(*camera)});
  return found;
}

}  // namespace crepes
