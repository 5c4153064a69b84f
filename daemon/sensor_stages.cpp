#include "daemon/sensor_stages.hpp"

#include <algorithm>

#include "daemon/logging.hpp"
#include "daemon/worker.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kFirstRetry = milliseconds{100};
constexpr Duration kLastRetry = seconds{5};
constexpr Duration kStatusPeriod = seconds{1};
constexpr Duration kLookPeriod = milliseconds{250};
constexpr Duration kWorked = seconds{1};  // so long open, a device is no hopeless case
constexpr Duration kSilence = milliseconds{1500};
constexpr milliseconds kReadTimeout{50};

/// Rate and health of a stage, told once a second; what is wrong is logged when it changes.
class HealthReport {
 public:
  HealthReport(std::string name, const StageContext& context)
      : name_(std::move(name)), context_(context), period_start_(context.clock.now()) {}

  void count(std::size_t measurements) { measurements_ += measurements; }

  [[nodiscard]] bool is_due() const {
    return context_.clock.now() - period_start_ >= kStatusPeriod;
  }

  /// Not to be kept until it is due: something has begun to be wrong.
  [[nodiscard]] bool is_news(const std::string& message) const {
    return !message.empty() && logged_.empty();
  }

  /// `message` is empty when all is well.
  void tell(const std::string& message, SensorTotals totals) {
    const Timestamp now = context_.clock.now();
    const double elapsed_s = std::max(to_seconds(now - period_start_), 1e-3);
    SensorStatus status;
    status.name = name_;
    status.rate_hz = static_cast<double>(measurements_) / elapsed_s;
    status.ok = message.empty();
    status.message = message;
    status.totals = std::move(totals);
    context_.tell(std::move(status));
    period_start_ = now;
    measurements_ = 0;

    if (message == logged_) return;
    if (message.empty()) {
      log_message(LogLevel::kInfo, name_ + ": works again");
    } else {
      log_message(LogLevel::kWarning, name_ + ": " + message);
    }
    logged_ = message;
  }

 private:
  std::string name_;
  const StageContext& context_;
  Timestamp period_start_;
  std::size_t measurements_ = 0;
  std::string logged_;
};

/// Reads until the device fails (the error), or `stop` or new settings (none). What is wrong is
/// told within two seconds.
Result<void> read_device(Device& device, const Sensor& sensor, const StageContext& context,
                         HealthReport& health, const std::stop_token& stop) {
  Timestamp last_heard = context.clock.now();
  Timestamp last_look = last_heard;
  while (!stop.stop_requested() && context.settings.empty()) {
    context.turns.add();
    const Result<std::size_t> count = device.read_once(kReadTimeout);
    if (!count) return tl::unexpected(count.error());
    health.count(*count);
    const Timestamp now = context.clock.now();
    if (*count > 0) last_heard = now;
    if (now - last_look < kLookPeriod) continue;
    last_look = now;
    std::string message = device.diagnosis().value_or("");
    if (message.empty() && now - last_heard > kSilence) message = sensor.when_silent;
    if (health.is_due() || health.is_news(message)) health.tell(message, device.counters());
  }
  return {};
}

/// A wait in small steps, so that the watchdog sees a living loop.
void back_off(Duration wait, const StageContext& context, const std::stop_token& stop) {
  const Timestamp end = context.clock.now() + wait;
  while (!stop.stop_requested() && context.settings.empty() && context.clock.now() < end) {
    context.turns.add();
    wait_for(milliseconds{100}, stop);
  }
}

/// Does what may take seconds on a thread of its own, so that the watchdog sees a living loop.
template <class Work>
auto do_aside(const StageContext& context, const std::string& name, const Work& work) {
  BoundedQueue<decltype(work())> done{1, Overflow::kDropOldest};
  const Worker worker(name, [&](const std::stop_token& /*stop*/) { done.push(work()); });
  auto result = done.try_pop();
  for (; !result; result = done.pop_for(milliseconds{100}, {})) context.turns.add();
  return std::move(*result);
}

class CameraDevice final : public Device {
 public:
  CameraDevice(std::unique_ptr<Camera> camera, const Clock& clock, FrameQueue& frames,
               FrameQueue& used)
      : camera_(std::move(camera)), clock_(clock), frames_(frames), used_(used) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    while (auto frame = used_.try_pop()) camera_->recycle(std::move(*frame));
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
  FrameQueue& used_;
};

/// In memory of its own.
Frame copy_of(const Frame& frame) {
  Frame copy{.stamp = frame.stamp,
             .arrival = frame.arrival,
             .camera = frame.camera,
             .width = frame.width,
             .height = frame.height,
             .pixels = std::vector<std::uint8_t>()};
  copy.pixels.reserve(static_cast<std::size_t>(frame.width) *
                      static_cast<std::size_t>(frame.height));
  for (int row = 0; row < frame.height; ++row) {
    const std::uint8_t* const begin = frame.data() + row * frame.stride();
    copy.pixels.insert(copy.pixels.end(), begin, begin + frame.width);
  }
  return copy;
}

std::string_view diagnosis_of(const Detection& found) {
  if (!found.failure.empty()) return found.failure;
  return found.exposure == Exposure::kBright
             ? "the picture is bright all over: shorten the exposure or mend the infrared filter"
             : "";
}

/// How long frames took from their arrival to their spots, since it was last asked.
class Delays {
 public:
  void add(Duration delay) { delays_.push_back(delay); }

  /// Median and 99th percentile [us].
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> take() {
    std::vector<Duration> sorted = std::exchange(delays_, {});
    if (sorted.empty()) return {};
    std::ranges::sort(sorted);
    const auto at = [&](std::size_t percent) {
      const Duration delay = sorted[(sorted.size() - 1) * percent / 100];
      return static_cast<std::uint64_t>(delay / std::chrono::microseconds{1});
    };
    return {at(50), at(99)};
  }

 private:
  std::vector<Duration> delays_;
};

SensorTotals totals_of(const Detection& found, const Rejected& rejected, std::uint64_t failures,
                       Delays& delays) {
  const auto [median_us, p99_us] = delays.take();
  return {.faults = {{"failures", failures}},
          .counts = {{"delay_p50_us", median_us},
                     {"delay_p99_us", p99_us},
                     {"threshold", static_cast<std::uint64_t>(found.threshold)},
                     {"hot", rejected.hot},
                     {"huge", rejected.huge},
                     {"faint", rejected.faint},
                     {"surplus", rejected.surplus}}};
}

}  // namespace

Sensor camera_sensor(const std::string& name, const OpenCamera& open, const Clock& clock,
                     FrameQueue& frames, FrameQueue& used) {
  Sensor sensor;
  sensor.name = name;
  sensor.when_silent = "no frame: is the camera plugged in and running?";
  sensor.open = [=, &clock, &frames, &used]() -> Result<std::unique_ptr<Device>> {
    while (used.try_pop()) continue;  // frames that keep the camera of before open
    Result<std::unique_ptr<Camera>> camera = open();
    if (!camera) return tl::unexpected(camera.error());
    return std::make_unique<CameraDevice>(std::move(*camera), clock, frames, used);
  };
  return sensor;
}

void run_sensor(Sensor sensor, const StageContext& context, const std::stop_token& stop) {
  HealthReport health(sensor.name, context);
  Duration retry = kFirstRetry;
  while (!stop.stop_requested()) {
    context.turns.add();
    if (const auto config = context.settings.try_pop()) {
      Sensor renewed = sensor.renewed(*config);
      sensor = std::move(renewed);
      retry = kFirstRetry;
    }
    Result<std::unique_ptr<Device>> device = do_aside(context, sensor.name + " open", sensor.open);
    if (device) {
      const Timestamp opened = context.clock.now();
      const Result<void> read = read_device(**device, sensor, context, health, stop);
      if (!read) health.tell(read.error().message, (*device)->counters());
      do_aside(context, sensor.name + " close", [&] {
        device->reset();
        return true;
      });
      if (context.clock.now() - opened > kWorked) retry = kFirstRetry;
    } else {
      health.tell(device.error().message, {});
      if (device.error().code == ErrorCode::kNotFound) retry = kFirstRetry;
    }
    back_off(retry, context, stop);
    retry = std::min(2 * retry, kLastRetry);
  }
}

void run_vision(const VisionStage& stage, const StageContext& context,
                const std::stop_token& stop) {
  std::optional<SpotDetector> detector(stage.config);
  HealthReport health(stage.camera_name + " spots", context);
  Rejected rejected;
  Delays delays;
  std::uint64_t failures = 0;
  while (!stop.stop_requested()) {
    context.turns.add();
    if (const auto config = context.settings.try_pop()) detector.emplace(config->vision);
    std::optional<Frame> frame = stage.frames.pop_for(milliseconds{100}, stop);
    if (!frame) continue;
    const Detection found =
        detector->detect({frame->data(), frame->width, frame->height, frame->stride()});
    stage.sink(SpotFrame{frame->stamp, frame->camera, {found.spots.begin(), found.spots.end()}});
    delays.add(context.clock.now() - frame->arrival);
    health.count(1);
    rejected += found.rejected;
    failures += found.failure.empty() ? 0 : 1;
    if (health.is_due())
      health.tell(std::string(diagnosis_of(found)), totals_of(found, rejected, failures, delays));
    if (stage.tap.wanted.try_pop()) stage.tap.taken.push(copy_of(*frame));
    stage.used.push(std::move(*frame));
  }
}

}  // namespace crepes
