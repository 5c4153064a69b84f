#include "daemon/sensor_stages.hpp"

#include <algorithm>

#include "daemon/logging.hpp"
#include "drivers/imu/bundle_spacing.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/serial/serial_reader.hpp"
#include "drivers/uwb/nlink.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kFirstRetry = milliseconds{100};
constexpr Duration kLastRetry = seconds{5};
constexpr Duration kStatusPeriod = seconds{1};
constexpr Duration kSilence = seconds{2};
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

  /// `message` is empty when all is well.
  void tell(const std::string& message, Totals counters) {
    const Timestamp now = context_.clock.now();
    const double elapsed_s = std::max(to_seconds(now - period_start_), 1e-3);
    SensorStatus status;
    status.name = name_;
    status.rate_hz = static_cast<double>(measurements_) / elapsed_s;
    status.ok = message.empty();
    status.message = message;
    status.counters = std::move(counters);
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

/// Reads until the device fails (the error) or `stop` (none).
Result<void> read_device(Device& device, const Sensor& sensor, const StageContext& context,
                         HealthReport& health, const std::stop_token& stop) {
  Timestamp last_heard = context.clock.now();
  while (!stop.stop_requested()) {
    context.turns.add();
    const Result<std::size_t> count = device.read_once(kReadTimeout);
    if (!count) return tl::unexpected(count.error());
    health.count(*count);
    if (*count > 0) last_heard = context.clock.now();
    if (!health.is_due()) continue;
    std::string message = device.diagnosis().value_or("");
    if (message.empty() && context.clock.now() - last_heard > kSilence)
      message = sensor.when_silent;
    health.tell(message, device.counters());
  }
  return {};
}

/// A wait in small steps, so that the watchdog sees a living loop.
void back_off(Duration wait, const StageContext& context, const std::stop_token& stop) {
  const Timestamp end = context.clock.now() + wait;
  while (!stop.stop_requested() && context.clock.now() < end) {
    context.turns.add();
    wait_for(milliseconds{100}, stop);
  }
}

Totals faults_of(const NlinkCounts& counts) {
  return {{"unknown_modules", counts.unknown_modules},
          {"implausible", counts.implausible},
          {"without_ranges", counts.without_ranges}};
}

Totals faults_of(const ImuCounts& counts) {
  return {{"partial", counts.partial},
          {"unscaled", counts.unscaled},
          {"saturated", counts.saturated},
          {"implausible", counts.implausible}};
}

/// `Arrange` puts right what was read at once: a function of a std::vector<Measurement>&.
template <class Parser, class Arrange>
class SerialDevice final : public Device {
 public:
  SerialDevice(SerialPort port, Parser parser, Arrange arrange, const Clock& clock, EventSink sink)
      : arrange_(std::move(arrange)),
        sink_(std::move(sink)),
        reader_(std::move(port), std::move(parser), clock,
                [this](const auto& measurement) { heard_.push_back(measurement); }) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    heard_.clear();
    if (const Result<void> read = reader_.read_once(timeout); !read)
      return tl::unexpected(read.error());
    arrange_(heard_);
    for (const auto& measurement : heard_) sink_(Event(measurement));
    return heard_.size();
  }

  [[nodiscard]] Totals counters() const override {
    Totals totals = faults_of(reader_.parser().counts());
    totals.emplace_back("skipped_bytes", reader_.counts().skipped_bytes);
    totals.emplace_back("checksum_failures", reader_.counts().checksum_failures);
    return totals;
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    return reader_.diagnosis();
  }

 private:
  Arrange arrange_;
  EventSink sink_;
  std::vector<typename Parser::Measurement> heard_;
  SerialReader<Parser> reader_;
};

template <class Parser, class Arrange>
Sensor serial_sensor(const std::string& name, const std::string& port, int baud,
                     const Parser& parser, const Arrange& arrange, const Clock& clock,
                     const EventSink& sink) {
  Sensor sensor;
  sensor.name = name;
  sensor.when_silent = port + ": silent for 2 s: is it powered, and is " + name + ".baud right?";
  sensor.open = [=, &clock]() -> Result<std::unique_ptr<Device>> {
    if (port.empty()) return fail(ErrorCode::kConfig, "no device: set " + name + ".port");
    Result<SerialPort> opened = SerialPort::open(port, baud);
    if (!opened) return tl::unexpected(opened.error());
    return std::make_unique<SerialDevice<Parser, Arrange>>(std::move(*opened), parser, arrange,
                                                           clock, sink);
  };
  return sensor;
}

class CameraDevice final : public Device {
 public:
  CameraDevice(std::unique_ptr<Camera> camera, FrameQueue& frames, FrameQueue& used)
      : camera_(std::move(camera)), frames_(frames), used_(used) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    while (auto frame = used_.try_pop()) camera_->recycle(std::move(*frame));
    Result<std::optional<Frame>> frame = camera_->read_once(timeout);
    if (!frame) return tl::unexpected(frame.error());
    if (!*frame) return 0;
    frames_.push(std::move(**frame));
    return 1;
  }

  [[nodiscard]] Totals counters() const override { return camera_->counters(); }
  [[nodiscard]] std::optional<std::string> diagnosis() const override { return std::nullopt; }

 private:
  std::unique_ptr<Camera> camera_;
  FrameQueue& frames_;
  FrameQueue& used_;
};

std::string_view diagnosis_of(const Detection& found) {
  if (!found.failure.empty()) return found.failure;
  return found.exposure == Exposure::kBright
             ? "the picture is bright all over: shorten the exposure or mend the infrared filter"
             : "";
}

Totals counters_of(const Detection& found, const Rejected& rejected, std::uint64_t failures) {
  return {{"threshold", static_cast<std::uint64_t>(found.threshold)},
          {"hot", rejected.hot},
          {"huge", rejected.huge},
          {"faint", rejected.faint},
          {"surplus", rejected.surplus},
          {"failures", failures}};
}

}  // namespace

Sensor uwb_sensor(const UwbConfig& config, const SwarmConfig& swarm, const Clock& clock,
                  const EventSink& sink) {
  return serial_sensor(
      "uwb", config.port, config.baud, NlinkParser(uwb_modules_of(swarm), config.max_range_m),
      [](const std::vector<UwbRange>&) {}, clock, sink);
}

Sensor imu_sensor(const ImuConfig& config, const Clock& clock, const EventSink& sink) {
  const auto space_out = [spacing = BundleSpacing(from_seconds(1.0 / config.update_rate))](
                             std::vector<ImuSample>& bundle) mutable { spacing.apply(bundle); };
  return serial_sensor("imu", config.port, config.baud, WitMotionParser(), space_out, clock, sink);
}

Sensor camera_sensor(const std::string& name, const OpenCamera& open, FrameQueue& frames,
                     FrameQueue& used) {
  Sensor sensor;
  sensor.name = name;
  sensor.when_silent = "no frame for 2 s: is the camera plugged in and running?";
  sensor.open = [=, &frames, &used]() -> Result<std::unique_ptr<Device>> {
    Result<std::unique_ptr<Camera>> camera = open();
    if (!camera) return tl::unexpected(camera.error());
    return std::make_unique<CameraDevice>(std::move(*camera), frames, used);
  };
  return sensor;
}

void run_sensor(const Sensor& sensor, const StageContext& context, const std::stop_token& stop) {
  HealthReport health(sensor.name, context);
  Duration retry = kFirstRetry;
  while (!stop.stop_requested()) {
    context.turns.add();
    Result<std::unique_ptr<Device>> device = sensor.open();
    if (device) {
      const Timestamp opened = context.clock.now();
      const Result<void> read = read_device(**device, sensor, context, health, stop);
      if (read) return;
      health.tell(read.error().message, (*device)->counters());
      if (context.clock.now() - opened > kLastRetry) retry = kFirstRetry;
    } else {
      health.tell(device.error().message, {});
    }
    back_off(retry, context, stop);
    retry = std::min(2 * retry, kLastRetry);
  }
}

void run_vision(const VisionStage& stage, const StageContext& context,
                const std::stop_token& stop) {
  SpotDetector detector(stage.config);
  HealthReport health(stage.camera_name + " spots", context);
  Rejected rejected;
  std::uint64_t failures = 0;
  while (!stop.stop_requested()) {
    context.turns.add();
    std::optional<Frame> frame = stage.frames.pop_for(milliseconds{100}, stop);
    if (!frame) continue;
    const Detection found = detector.detect(
        {frame->pixels.data(), frame->width, frame->height, std::ptrdiff_t{frame->width}});
    stage.sink(SpotFrame{frame->stamp, frame->camera, {found.spots.begin(), found.spots.end()}});
    health.count(1);
    rejected += found.rejected;
    failures += found.failure.empty() ? 0 : 1;
    if (health.is_due())
      health.tell(std::string(diagnosis_of(found)), counters_of(found, rejected, failures));
    stage.used.push(std::move(*frame));
  }
}

}  // namespace crepes
