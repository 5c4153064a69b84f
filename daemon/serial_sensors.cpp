#include <utility>

#include "daemon/sensor_stages.hpp"
#include "drivers/imu/bundle_spacing.hpp"
#include "drivers/imu/hipnuc.hpp"
#include "drivers/imu/imu_correction.hpp"
#include "drivers/imu/imu_health.hpp"
#include "drivers/imu/mavlink.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/imu/xsens.hpp"
#include "drivers/recognize.hpp"
#include "drivers/serial/device_name.hpp"
#include "drivers/serial/serial_reader.hpp"
#include "drivers/uwb/nlink.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;

/// A module may send other frames beside those with ranges.
SensorTotals totals_of(const NlinkCounts& counts) {
  return {.faults = {{"unknown_modules", counts.unknown_modules},
                     {"implausible", counts.implausible},
                     {"clock_restarts", counts.clock_restarts}},
          .counts = {{"ranges", counts.ranges}, {"without_ranges", counts.without_ranges}}};
}

/// An autopilot may send numbers without a unit beside samples.
SensorTotals totals_of(const ImuCounts& counts) {
  return {.faults = {{"partial", counts.partial},
                     {"saturated", counts.saturated},
                     {"implausible", counts.implausible},
                     {"clock_restarts", counts.clock_restarts}},
          .counts = {{"samples", counts.samples}, {"unscaled", counts.unscaled}}};
}

/// Ranges are handed on as they are.
struct UwbIntake {
  void arrange(const std::vector<UwbRange>& /*bundle*/) {}
  [[nodiscard]] static Totals faults() { return {}; }
  [[nodiscard]] static std::optional<std::string> diagnosis() { return std::nullopt; }
};

/// What becomes of samples that were read at once before the estimator sees them.
class ImuIntake {
 public:
  explicit ImuIntake(const ImuConfig& config)
      : spacing_(from_seconds(1.0 / config.update_rate)),
        health_(from_seconds(1.0 / config.update_rate)),
        correction_(config) {}

  void arrange(std::vector<ImuSample>& bundle) {
    spacing_.apply(bundle);
    std::erase_if(bundle, [this](const ImuSample& sample) { return !health_.accept(sample); });
    for (ImuSample& sample : bundle) sample = correction_.apply(sample);
  }

  [[nodiscard]] Totals faults() const {
    return {{"dropped", health_.counts().dropped}, {"stuck", health_.counts().stuck}};
  }
  [[nodiscard]] std::optional<std::string> diagnosis() const { return health_.diagnosis(); }

 private:
  BundleSpacing spacing_;
  ImuHealth health_;
  ImuCorrection correction_;
};

template <class Parser, class Intake>
class SerialDevice final : public Device {
 public:
  SerialDevice(SerialPort port, Parser parser, Intake intake, const Clock& clock, EventSink sink)
      : intake_(std::move(intake)),
        sink_(std::move(sink)),
        reader_(std::move(port), std::move(parser), clock,
                [this](const auto& measurement) { heard_.push_back(measurement); }) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    heard_.clear();
    if (const Result<void> read = reader_.read_once(timeout); !read)
      return tl::unexpected(read.error());
    intake_.arrange(heard_);
    for (const auto& measurement : heard_) sink_(Event(measurement));
    return heard_.size();
  }

  [[nodiscard]] SensorTotals counters() const override {
    SensorTotals totals = totals_of(reader_.parser().counts());
    for (auto& fault : intake_.faults()) totals.faults.push_back(std::move(fault));
    totals.faults.emplace_back("skipped_bytes", reader_.counts().skipped_bytes);
    totals.faults.emplace_back("checksum_failures", reader_.counts().checksum_failures);
    return totals;
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    std::optional<std::string> fault = reader_.diagnosis();
    return fault ? fault : intake_.diagnosis();
  }

 private:
  Intake intake_;
  EventSink sink_;
  std::vector<typename Parser::Measurement> heard_;
  SerialReader<Parser> reader_;
};

using OpenDevice = std::function<std::unique_ptr<Device>(SerialPort)>;

template <class Parser, class Intake>
OpenDevice device_with(const Parser& parser, const Intake& intake, const Clock& clock,
                       const EventSink& sink) {
  return [=, &clock](SerialPort port) {
    return std::make_unique<SerialDevice<Parser, Intake>>(std::move(port), parser, intake, clock,
                                                          sink);
  };
}

/// The inertial sensor that speaks `protocol`; empty for what is none.
OpenDevice imu_device(SpokenProtocol protocol, const ImuConfig& config, const Clock& clock,
                      const EventSink& sink) {
  const ImuIntake intake(config);
  if (protocol == SpokenProtocol::kWitMotion)
    return device_with(WitMotionParser(), intake, clock, sink);
  if (protocol == SpokenProtocol::kHipnuc) return device_with(HipnucParser(), intake, clock, sink);
  if (protocol == SpokenProtocol::kXsens) return device_with(XsensParser(), intake, clock, sink);
  if (protocol == SpokenProtocol::kMavlink)
    return device_with(MavlinkParser(), intake, clock, sink);
  return nullptr;
}

/// Listens until it knows what the inertial sensor speaks, and is that device from then on.
class UnknownImu final : public Device {
 public:
  UnknownImu(SerialPort port, const ImuConfig& config, const Clock& clock, const EventSink& sink)
      : port_(std::move(port)),
        since_(clock.now()),
        clock_(clock),
        device_of_([=, &clock](SpokenProtocol protocol) {
          return imu_device(protocol, config, clock, sink);
        }) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    if (known_) return known_->read_once(timeout);
    const Result<Bytes> chunk = port_.read_some(timeout);
    if (!chunk) return tl::unexpected(chunk.error());
    recent_.add(*chunk);
    if (chunk->empty()) return 0;
    if (const auto spoken = recognize(recent_.get())) {
      if (const OpenDevice open = device_of_(*spoken)) known_ = open(std::move(port_));
    }
    return 0;
  }

  [[nodiscard]] SensorTotals counters() const override {
    return known_ ? known_->counters() : SensorTotals{};
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    constexpr Duration kPatience = std::chrono::seconds(1);
    constexpr std::size_t kEnoughBytes = 64;
    if (known_) return known_->diagnosis();
    if (clock_.now() - since_ < kPatience || recent_.get().size() < kEnoughBytes)
      return std::nullopt;
    if (const auto spoken = recognize(recent_.get()))
      return port_.path() + ": no inertial sensor: it speaks " + std::string(name_of(*spoken));
    return port_.path() +
           ": bytes that are none of witmotion, hipnuc, xsens, mavlink; wrong baud rate or another "
           "kind of device?";
  }

 private:
  SerialPort port_;
  RecentBytes recent_;
  Timestamp since_;
  const Clock& clock_;
  std::function<OpenDevice(SpokenProtocol)> device_of_;
  std::unique_ptr<Device> known_;
};

OpenDevice configured_imu(const ImuConfig& config, const Clock& clock, const EventSink& sink) {
  switch (config.protocol) {
    case ImuProtocol::kWitMotion:
      return imu_device(SpokenProtocol::kWitMotion, config, clock, sink);
    case ImuProtocol::kHipnuc:
      return imu_device(SpokenProtocol::kHipnuc, config, clock, sink);
    case ImuProtocol::kXsens:
      return imu_device(SpokenProtocol::kXsens, config, clock, sink);
    case ImuProtocol::kMavlink:
      return imu_device(SpokenProtocol::kMavlink, config, clock, sink);
    case ImuProtocol::kAuto:
      break;
  }
  return [=, &clock](SerialPort port) {
    return std::make_unique<UnknownImu>(std::move(port), config, clock, sink);
  };
}

/// `port` is found again after it was unplugged, under another name if need be.
Sensor serial_sensor(const std::string& name, const std::string& port, int baud,
                     const OpenDevice& device, const std::string& by_id) {
  Sensor sensor;
  sensor.name = name;
  sensor.when_silent = port + ": silent: is it powered and wired, and is " + name + ".baud right?";
  sensor.open = [=, found = DeviceName(port, by_id)]() mutable -> Result<std::unique_ptr<Device>> {
    if (port.empty()) return fail(ErrorCode::kConfig, "no device: set " + name + ".port");
    return SerialPort::open(found.to_open(), baud).map([&](SerialPort&& opened) {
      found.remember();
      return device(std::move(opened));
    });
  };
  return sensor;
}

}  // namespace

Sensor uwb_sensor(const UwbConfig& config, const SwarmConfig& swarm, const Clock& clock,
                  const EventSink& sink, const std::string& by_id) {
  const NlinkParser parser(uwb_modules_of(swarm), config.max_range_m);
  Sensor sensor = serial_sensor("uwb", config.port, config.baud,
                                device_with(parser, UwbIntake{}, clock, sink), by_id);
  sensor.renewed = [=, &clock](const Config& renewed) {
    return uwb_sensor(renewed.uwb, renewed.swarm, clock, sink, by_id);
  };
  return sensor;
}

Sensor imu_sensor(const ImuConfig& config, const Clock& clock, const EventSink& sink,
                  const std::string& by_id) {
  Sensor sensor =
      serial_sensor("imu", config.port, config.baud, configured_imu(config, clock, sink), by_id);
  sensor.renewed = [=, &clock](const Config& renewed) {
    return imu_sensor(renewed.imu, clock, sink, by_id);
  };
  return sensor;
}

}  // namespace crepes
