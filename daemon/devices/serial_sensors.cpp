#include "daemon/devices/serial_sensors.hpp"

#include <fmt/core.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

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

/// What opens a device of a parser.
template <class Settings>
using DeviceMaker = OpenDevice (*)(const Settings&, const Clock&, const EventSink&);

template <class Parser>
OpenDevice imu_device(const ImuSensorSettings& settings, const Clock& clock,
                      const EventSink& sink) {
  return device_with(Parser(), ImuPreprocessing(settings), clock, sink);
}

template <class Parser>
OpenDevice uwb_device(const UwbSensorSettings& settings, const Clock& clock,
                      const EventSink& sink) {
  return device_with(Parser(settings.modules, settings.max_range_m, settings.own_module),
                     UwbPreprocessing{}, clock, sink);
}

/// A protocol as it is configured and as it is detected, and who speaks it.
template <class Protocol, class Settings>
struct Dialect {
  Protocol configured;
  SerialProtocol spoken;
  DeviceMaker<Settings> device;
};

using ImuDialect = Dialect<ImuProtocol, ImuSensorSettings>;
constexpr std::array kImuDialects{
    ImuDialect{ImuProtocol::kWitMotion, SerialProtocol::kWitMotion, &imu_device<WitMotionParser>},
    ImuDialect{ImuProtocol::kWitMotionBle, SerialProtocol::kWitMotionBle,
               &imu_device<WitMotionBleParser>},
    ImuDialect{ImuProtocol::kHipnuc, SerialProtocol::kHipnuc, &imu_device<HipnucParser>},
    ImuDialect{ImuProtocol::kXsens, SerialProtocol::kXsens, &imu_device<XsensParser>},
    ImuDialect{ImuProtocol::kMavlink, SerialProtocol::kMavlink, &imu_device<MavlinkParser>},
    ImuDialect{ImuProtocol::kVectorNav, SerialProtocol::kVectorNav, &imu_device<VectorNavParser>},
    ImuDialect{ImuProtocol::kMicroStrain, SerialProtocol::kMicroStrain,
               &imu_device<MicroStrainParser>}};
static_assert(kImuDialects.size() + 2 == kImuProtocols.size(), "all but auto and iio");

using UwbDialect = Dialect<UwbProtocol, UwbSensorSettings>;
constexpr std::array kUwbDialects{
    UwbDialect{UwbProtocol::kLinkTrack, SerialProtocol::kNlink, &uwb_device<NlinkParser>},
    UwbDialect{UwbProtocol::kDwm1001Shell, SerialProtocol::kDwm1001Shell,
               &uwb_device<Dwm1001ShellParser>},
    UwbDialect{UwbProtocol::kDwm1001Tlv, SerialProtocol::kDwm1001Tlv,
               &uwb_device<Dwm1001TlvParser>},
    UwbDialect{UwbProtocol::kMaUwb, SerialProtocol::kMaUwb, &uwb_device<MaUwbParser>},
    UwbDialect{UwbProtocol::kFiraUci, SerialProtocol::kFiraUci, &uwb_device<FiraUciParser>},
    UwbDialect{UwbProtocol::kBu03, SerialProtocol::kBu03, &uwb_device<Bu03Parser>},
    UwbDialect{UwbProtocol::kRangeLine, SerialProtocol::kRangeLine, &uwb_device<RangeLineParser>}};
static_assert(kUwbDialects.size() + 1 == kUwbProtocols.size(), "all but auto");

/// The mode in which a LinkTrack module sends nothing that could be recognized.
std::optional<std::string> foreign_meaning(Bytes recent) {
  if (!is_in_another_mode<NlinkParser>(recent)) return std::nullopt;
  return std::string(NlinkParser::kForeignMeaning);
}

/// What a port is searched for, in words.
struct WantedDevice {
  std::string kind;
  std::string protocols;  ///< the names of all that would do
  /// What bytes without frames mean.
  std::optional<std::string> (*hint)(Bytes recent) = [](Bytes) {
    return std::optional<std::string>();
  };
};

/// Listens until the protocol is recognized; from then on it is that device.
class UnknownDevice final : public Device {
 public:
  UnknownDevice(SerialPort port, WantedDevice wanted, const Clock& clock,
                std::function<OpenDevice(SerialProtocol)> device_of)
      : port_(std::move(port)),
        wanted_(std::move(wanted)),
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
    if (const auto meaning = wanted_.hint(recent_.get()))
      return fmt::format("{}: {}", port_.path(), *meaning);
    if (clock_.now() - since_ < kPatience || recent_.get().size() < kEnoughBytes)
      return std::nullopt;
    if (const auto spoken = detect_protocol(recent_.get()))
      return fmt::format("{}: no {}: it speaks {}", port_.path(), wanted_.kind, name_of(*spoken));
    return fmt::format("{}: bytes that are none of {}; wrong baud rate or another kind of device?",
                       port_.path(), wanted_.protocols);
  }

 private:
  SerialPort port_;
  WantedDevice wanted_;
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

/// The device of the configured protocol, or one that detects which of `dialects` it speaks.
template <class Settings, class Dialects>
OpenDevice configured_device(const Settings& settings, const Dialects& dialects,
                             const WantedDevice& wanted, const Clock& clock,
                             const EventSink& sink) {
  for (const auto& dialect : dialects) {
    if (dialect.configured == settings.device.protocol)
      return dialect.device(settings, clock, sink);
  }
  const auto device_of = [=, &dialects, &clock](SerialProtocol spoken) {
    for (const auto& dialect : dialects)
      if (dialect.spoken == spoken) return dialect.device(settings, clock, sink);
    return OpenDevice();
  };
  return [=, &clock](SerialPort port) {
    return std::make_unique<UnknownDevice>(std::move(port), wanted, clock, device_of);
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
  const WantedDevice wanted{"ranging module", names_of(kUwbProtocols), &foreign_meaning};
  return serial_sensor("uwb", settings.device.port, settings.device.baud,
                       configured_device(settings, kUwbDialects, wanted, clock, sink), name);
}

Sensor imu_sensor(const ImuSensorSettings& settings, const Clock& clock, const EventSink& sink,
                  DeviceName& name) {
  if (settings.device.protocol == ImuProtocol::kIio) return iio_sensor(settings, clock, sink);
  const WantedDevice wanted{.kind = "inertial sensor", .protocols = names_of(kImuProtocols)};
  return serial_sensor("imu", settings.device.port, settings.device.baud,
                       configured_device(settings, kImuDialects, wanted, clock, sink), name);
}

}  // namespace crepes
