#include "daemon/devices/serial_sensors.hpp"

#include <fmt/core.h>

#include <type_traits>
#include <utility>

#include "daemon/devices/iio_sensor.hpp"
#include "daemon/devices/imu_preprocessing.hpp"
#include "drivers/detect_protocol.hpp"
#include "drivers/imu/hipnuc.hpp"
#include "drivers/imu/mavlink.hpp"
#include "drivers/imu/microstrain.hpp"
#include "drivers/imu/vectornav.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/imu/xsens.hpp"
#include "drivers/serial/device_name.hpp"
#include "drivers/serial/serial_reader.hpp"
#include "drivers/uwb/bu03.hpp"
#include "drivers/uwb/dwm1001.hpp"
#include "drivers/uwb/fira_uci.hpp"
#include "drivers/uwb/mauwb.hpp"
#include "drivers/uwb/nlink.hpp"
#include "drivers/uwb/range_line.hpp"

namespace crepes {
namespace {

using std::chrono::milliseconds;

/// A module may send other frames beside those with ranges.
SensorTotals totals_of(const UwbCounts& counts) {
  return {.faults = {{"unknown_modules", counts.unknown_modules},
                     {"implausible", counts.implausible},
                     {"clock_restarts", counts.clock_restarts}},
          .counts = {{"ranges", counts.ranges}, {"without_ranges", counts.without_ranges}}};
}

/// Ranges are forwarded unchanged.
struct UwbPreprocessing {
  void apply(const std::vector<UwbRange>& /*bundle*/) {}
  [[nodiscard]] static Totals faults() { return {}; }
  [[nodiscard]] static Totals counts() { return {}; }
  [[nodiscard]] static std::optional<std::string> diagnosis() { return std::nullopt; }
};

template <class Parser, class Preprocessing>
class SerialDevice final : public Device {
 public:
  SerialDevice(SerialPort port, Parser parser, Preprocessing preprocessing, const Clock& clock,
               EventSink sink)
      : preprocessing_(std::move(preprocessing)),
        sink_(std::move(sink)),
        reader_(std::move(port), std::move(parser), clock,
                [this](const auto& measurement) { received_.push_back(measurement); }) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    received_.clear();
    if (const Result<void> read = reader_.read_once(timeout); !read)
      return tl::unexpected(read.error());
    preprocessing_.apply(received_);
    for (const auto& measurement : received_) sink_(Event(measurement));
    return received_.size();
  }

  [[nodiscard]] SensorTotals counters() const override {
    SensorTotals totals = totals_of(reader_.parser().counts());
    for (auto& fault : preprocessing_.faults()) totals.faults.push_back(std::move(fault));
    for (auto& count : preprocessing_.counts()) totals.counts.push_back(std::move(count));
    totals.faults.emplace_back("skipped_bytes", reader_.counts().skipped_bytes);
    totals.faults.emplace_back("checksum_failures", reader_.counts().checksum_failures);
    totals.counts.emplace_back("unchecked_frames", reader_.counts().unchecked);
    return totals;
  }

  [[nodiscard]] std::optional<std::string> diagnosis() const override {
    std::optional<std::string> fault = reader_.diagnosis();
    return fault ? fault : preprocessing_.diagnosis();
  }

 private:
  Preprocessing preprocessing_;
  EventSink sink_;
  std::vector<typename Parser::Measurement> received_;
  SerialReader<Parser> reader_;
};

using OpenDevice = std::function<std::unique_ptr<Device>(SerialPort)>;

template <class Parser, class Preprocessing>
OpenDevice device_with(const Parser& parser, const Preprocessing& preprocessing, const Clock& clock,
                       const EventSink& sink) {
  return [=, &clock](SerialPort port) {
    return std::make_unique<SerialDevice<Parser, Preprocessing>>(std::move(port), parser,
                                                                 preprocessing, clock, sink);
  };
}

/// Opens an inertial sensor with `protocol`; empty if that is not the protocol of an IMU.
OpenDevice imu_device(SerialProtocol protocol, const ImuSensorSettings& settings,
                      const Clock& clock, const EventSink& sink) {
  const ImuPreprocessing preprocessing(settings);
  if (protocol == SerialProtocol::kWitMotion)
    return device_with(WitMotionParser(), preprocessing, clock, sink);
  if (protocol == SerialProtocol::kWitMotionBle)
    return device_with(WitMotionBleParser(), preprocessing, clock, sink);
  if (protocol == SerialProtocol::kHipnuc)
    return device_with(HipnucParser(), preprocessing, clock, sink);
  if (protocol == SerialProtocol::kXsens)
    return device_with(XsensParser(), preprocessing, clock, sink);
  if (protocol == SerialProtocol::kMavlink)
    return device_with(MavlinkParser(), preprocessing, clock, sink);
  if (protocol == SerialProtocol::kVectorNav)
    return device_with(VectorNavParser(), preprocessing, clock, sink);
  if (protocol == SerialProtocol::kMicroStrain)
    return device_with(MicroStrainParser(), preprocessing, clock, sink);
  return nullptr;
}

/// The parser of a ranging module that speaks `protocol`; empty if that is not of one.
OpenDevice uwb_device(SerialProtocol protocol, const UwbSensorSettings& settings,
                      const Clock& clock, const EventSink& sink) {
  const auto with = [&]<class Parser>(std::type_identity<Parser>) {
    return device_with(Parser(settings.modules, settings.max_range_m, settings.own_module),
                       UwbPreprocessing{}, clock, sink);
  };
  switch (protocol) {
    case SerialProtocol::kNlink:
      return with(std::type_identity<NlinkParser>());
    case SerialProtocol::kDwm1001Shell:
      return with(std::type_identity<Dwm1001ShellParser>());
    case SerialProtocol::kDwm1001Tlv:
      return with(std::type_identity<Dwm1001TlvParser>());
    case SerialProtocol::kMaUwb:
      return with(std::type_identity<MaUwbParser>());
    case SerialProtocol::kFiraUci:
      return with(std::type_identity<FiraUciParser>());
    case SerialProtocol::kBu03:
      return with(std::type_identity<Bu03Parser>());
    case SerialProtocol::kRangeLine:
      return with(std::type_identity<RangeLineParser>());
    default:
      return nullptr;
  }
}

/// The mode in which a LinkTrack module sends nothing that could be recognized.
std::optional<std::string> foreign_meaning(Bytes recent) {
  if (!is_in_another_mode<NlinkParser>(recent)) return std::nullopt;
  return std::string(NlinkParser::kForeignMeaning);
}

/// Listens until the protocol is recognized; from then on it is that device.
class UnknownDevice final : public Device {
 public:
  using Hint = std::optional<std::string> (*)(Bytes recent);

  /// `kind` is what is wanted, `protocols` are the names of all that would do. `hint` knows bytes
  /// without frames.
  UnknownDevice(SerialPort port, std::string kind, std::string protocols, Hint hint,
                const Clock& clock, std::function<OpenDevice(SerialProtocol)> device_of)
      : port_(std::move(port)),
        kind_(std::move(kind)),
        protocols_(std::move(protocols)),
        hint_(hint),
        since_(clock.now()),
        clock_(clock),
        device_of_(std::move(device_of)) {}

  [[nodiscard]] Result<std::size_t> read_once(milliseconds timeout) override {
    if (known_) return known_->read_once(timeout);
    const Result<Bytes> chunk = port_.read_some(timeout);
    if (!chunk) return tl::unexpected(chunk.error());
    recent_.add(*chunk);
    if (chunk->empty()) return 0;
    if (const auto spoken = detect_protocol(recent_.get())) {
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
    if (const auto meaning = hint_(recent_.get()))
      return fmt::format("{}: {}", port_.path(), *meaning);
    if (clock_.now() - since_ < kPatience || recent_.get().size() < kEnoughBytes)
      return std::nullopt;
    if (const auto spoken = detect_protocol(recent_.get()))
      return fmt::format("{}: no {}: it speaks {}", port_.path(), kind_, name_of(*spoken));
    return fmt::format("{}: bytes that are none of {}; wrong baud rate or another kind of device?",
                       port_.path(), protocols_);
  }

 private:
  SerialPort port_;
  std::string kind_;
  std::string protocols_;
  Hint hint_;
  RecentBytes recent_;
  Timestamp since_;
  const Clock& clock_;
  std::function<OpenDevice(SerialProtocol)> device_of_;
  std::unique_ptr<Device> known_;
};

/// The names of the protocols that one kind of device may speak on a serial port.
template <class Choices>
std::string names_of(const Choices& choices) {
  std::string names;
  for (const auto& choice : choices) {
    if (choice.name == "auto" || choice.name == "iio") continue;
    names += (names.empty() ? "" : ", ") + std::string(choice.name);
  }
  return names;
}

OpenDevice configured_uwb(const UwbSensorSettings& settings, const Clock& clock,
                          const EventSink& sink) {
  const auto device_of = [=, &clock](SerialProtocol protocol) {
    return uwb_device(protocol, settings, clock, sink);
  };
  switch (settings.device.protocol) {
    case UwbProtocol::kLinkTrack:
      return device_of(SerialProtocol::kNlink);
    case UwbProtocol::kDwm1001Shell:
      return device_of(SerialProtocol::kDwm1001Shell);
    case UwbProtocol::kDwm1001Tlv:
      return device_of(SerialProtocol::kDwm1001Tlv);
    case UwbProtocol::kMaUwb:
      return device_of(SerialProtocol::kMaUwb);
    case UwbProtocol::kFiraUci:
      return device_of(SerialProtocol::kFiraUci);
    case UwbProtocol::kBu03:
      return device_of(SerialProtocol::kBu03);
    case UwbProtocol::kRangeLine:
      return device_of(SerialProtocol::kRangeLine);
    case UwbProtocol::kAuto:
      break;
  }
  return [=, &clock](SerialPort port) {
    return std::make_unique<UnknownDevice>(std::move(port), "ranging module",
                                           names_of(kUwbProtocols), &foreign_meaning, clock,
                                           device_of);
  };
}

OpenDevice configured_imu(const ImuSensorSettings& settings, const Clock& clock,
                          const EventSink& sink) {
  switch (settings.device.protocol) {
    case ImuProtocol::kWitMotion:
      return imu_device(SerialProtocol::kWitMotion, settings, clock, sink);
    case ImuProtocol::kWitMotionBle:
      return imu_device(SerialProtocol::kWitMotionBle, settings, clock, sink);
    case ImuProtocol::kHipnuc:
      return imu_device(SerialProtocol::kHipnuc, settings, clock, sink);
    case ImuProtocol::kXsens:
      return imu_device(SerialProtocol::kXsens, settings, clock, sink);
    case ImuProtocol::kMavlink:
      return imu_device(SerialProtocol::kMavlink, settings, clock, sink);
    case ImuProtocol::kVectorNav:
      return imu_device(SerialProtocol::kVectorNav, settings, clock, sink);
    case ImuProtocol::kMicroStrain:
      return imu_device(SerialProtocol::kMicroStrain, settings, clock, sink);
    case ImuProtocol::kIio:  // on no serial port
    case ImuProtocol::kAuto:
      break;
  }
  const auto device_of = [=, &clock](SerialProtocol protocol) {
    return imu_device(protocol, settings, clock, sink);
  };
  return [=, &clock](SerialPort port) {
    const auto no_hint = [](Bytes) -> std::optional<std::string> { return std::nullopt; };
    return std::make_unique<UnknownDevice>(std::move(port), "inertial sensor",
                                           names_of(kImuProtocols), no_hint, clock, device_of);
  };
}

/// A device that was unplugged is found again, also under another port name.
Sensor serial_sensor(const std::string& name, const std::string& port, int baud,
                     const OpenDevice& device, DeviceName& found) {
  found.configure(port);
  Sensor sensor;
  sensor.name = name;
  sensor.silence_hint =
      fmt::format("{}: silent: is it powered and wired, and is {}.baud right?", port, name);
  sensor.open = [=, &found]() -> Result<std::unique_ptr<Device>> {
    if (port.empty()) return fail(ErrorCode::kConfig, fmt::format("no device: set {}.port", name));
    return SerialPort::open(found.path_to_open(), baud).map([&](SerialPort&& opened) {
      found.remember_link();
      return device(std::move(opened));
    });
  };
  return sensor;
}

}  // namespace

UwbSensorSettings uwb_sensor_settings(const Config& config) {
  return {.device = config.uwb.device,
          .modules = uwb_modules_of(config.swarm),
          .own_module = uwb_module_of(config.swarm, config.robot.id),
          .max_range_m = config.uwb.noise.max_range_m};
}

ImuSensorSettings imu_sensor_settings(const Config& config) {
  return {.device = config.imu.device, .rate_hz = config.imu.noise.update_rate};
}

Sensor uwb_sensor(const UwbSensorSettings& settings, const Clock& clock, const EventSink& sink,
                  DeviceName& name) {
  return serial_sensor("uwb", settings.device.port, settings.device.baud,
                       configured_uwb(settings, clock, sink), name);
}

Sensor imu_sensor(const ImuSensorSettings& settings, const Clock& clock, const EventSink& sink,
                  DeviceName& name) {
  if (settings.device.protocol == ImuProtocol::kIio) return iio_sensor(settings, clock, sink);
  return serial_sensor("imu", settings.device.port, settings.device.baud,
                       configured_imu(settings, clock, sink), name);
}

}  // namespace crepes
