#include "drivers/iio/iio_buffer.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <system_error>
#include <utility>

#include "drivers/serial/device_name.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kAxisNames = "xyz";
constexpr std::string_view kEnabled = "_en";

/// A channel of the buffer that is read.
struct Channel {
  std::string name;
  double index = 0.0;
  ScanElement element;
};

tl::unexpected<Error> not_opened(const std::string& path, int error) {
  std::string message = std::generic_category().message(error);
  if (error == EBUSY) message = "in use by " + process_using(path).value_or("another program");
  if (error == EACCES) message += "; see \"Linux IIO\" in sensors.md for the permission";
  return fail(error == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo,
              fmt::format("{}: {}", path, message));
}

Result<UniqueFd> open_to_read(const std::string& path) {
  UniqueFd fd{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)};
  if (!fd) return not_opened(path, errno);
  return fd;
}

std::vector<std::string> channels_of(std::string_view quantity) {
  std::vector<std::string> names;
  for (const char axis : kAxisNames) names.push_back(fmt::format("in_{}_{}", quantity, axis));
  return names;
}

Result<Channel> enable_channel(const IioDevice& device, const std::string& name) {
  const std::string base = "scan_elements/" + name;
  if (!device.attributes.has(base + "_en")) {
    return fail(ErrorCode::kFormat,
                fmt::format("{}: no channel {} in its buffer", device.title(), name));
  }
  const Result<void> set = device.attributes.set(base + "_en", "1");
  if (!set) return tl::unexpected(set.error());
  const Result<double> index = device.attributes.number(base + "_index");
  if (!index) return tl::unexpected(index.error());
  const Result<std::string> type = device.attributes.text(base + "_type");
  if (!type) return tl::unexpected(type.error());
  return parse_scan_element(*type)
      .map([&](const ScanElement& element) {
        return Channel{name, *index, element};
      })
      .map_error([&](Error error) {
        return std::move(error).with_context(fmt::format("{}: {}", device.title(), name));
      });
}

Result<void> disable_all_but(const IioDevice& device, const std::vector<std::string>& wanted) {
  std::error_code failed;
  for (const auto& entry :
       fs::directory_iterator(device.attributes.folder() / "scan_elements", failed)) {
    const std::string file = entry.path().filename();
    if (!file.ends_with(kEnabled)) continue;
    const std::string name = file.substr(0, file.size() - kEnabled.size());
    if (std::ranges::find(wanted, name) != wanted.end()) continue;
    if (Result<void> set = device.attributes.set("scan_elements/" + file, "0"); !set) return set;
  }
  return {};
}

std::size_t place_of(const std::vector<Channel>& channels, const std::string& name) {
  const auto found = std::ranges::find(channels, name, &Channel::name);
  return static_cast<std::size_t>(found - channels.begin());
}

}  // namespace

Result<std::string> set_sampling_rate(const IioDevice& device, std::string_view quantity,
                                      double wanted_hz) {
  constexpr double kTolerance = 0.25;
  std::string name = fmt::format("in_{}_sampling_frequency", quantity);
  if (!device.attributes.has(name)) name = "sampling_frequency";
  if (!device.attributes.has(name)) return std::string();
  const std::string available = device.attributes.text(name + "_available").value_or("");
  const double rate_hz = nearest_rate(available, wanted_hz);
  const Result<double> now = device.attributes.number(name);
  if (!now || std::abs(*now - rate_hz) > 1e-3 * rate_hz) {
    const Result<void> set = device.attributes.set(name, fmt::format("{:g}", rate_hz));
    // The rate may be one that both sensors of a chip share. Then it counts what it is.
    if (!set && !now) return tl::unexpected(set.error());
  }
  return device.attributes.number(name).map([&](double hz) {
    if (std::abs(hz - wanted_hz) <= kTolerance * wanted_hz) return std::string();
    return fmt::format("{}: it samples at {:g} Hz, imu.update_rate is {:g}; set either",
                       device.title(), hz, wanted_hz);
  });
}

Result<IioBuffer> IioBuffer::open(const IioPaths& paths, const IioDevice& device,
                                  IioQuantities wanted, double rate_hz) {
  Result<UniqueFd> fd = open_to_read(paths.dev / device.id);
  if (!fd) return tl::unexpected(fd.error());
  IioBuffer buffer(std::move(*fd), device);
  if (const Result<void> ready = buffer.set_up(paths, wanted, rate_hz); !ready)
    return tl::unexpected(ready.error());
  return buffer;
}

IioBuffer::~IioBuffer() {
  if (fd_) static_cast<void>(device_.attributes.set("buffer/enable", "0"));
}

Result<void> IioBuffer::set_up(const IioPaths& paths, IioQuantities wanted, double rate_hz) {
  constexpr double kLatency = 0.005;  // s: waking up more rarely saves work, at high rates
  const auto watermark = std::max(1L, std::lround(kLatency * rate_hz));
  const IioAttributes& attributes = device_.attributes;
  return attributes.set("buffer/enable", "0")
      .map([&] { drop_old_scans(); })
      .and_then([&] { return choose_clock(); })
      .and_then([&] { return wanted.rate ? choose_rate("anglvel", rate_hz) : Result<void>(); })
      .and_then(
          [&] { return wanted.acceleration ? choose_rate("accel", rate_hz) : Result<void>(); })
      .and_then([&] { return choose_trigger(paths); })
      .and_then([&] { return choose_elements(wanted); })
      .and_then([&] { return attributes.set("buffer/length", "256"); })
      .and_then([&]() -> Result<void> {
        // Not all buffers have one; then each scan wakes the reader up.
        static_cast<void>(attributes.set("buffer/watermark", fmt::format("{}", watermark)));
        return attributes.set("buffer/enable", "1");
      });
}

/// Of a program that ended without stopping the buffer.
void IioBuffer::drop_old_scans() const {
  std::array<std::uint8_t, 4096> scans{};
  while (::read(fd_.get(), scans.data(), scans.size()) > 0) continue;
}

Result<void> IioBuffer::choose_rate(std::string_view quantity, double rate_hz) {
  return set_sampling_rate(device_, quantity, rate_hz).map([&](const std::string& fault) {
    if (wrong_rate_.empty()) wrong_rate_ = fault;
  });
}

/// Stamps of CLOCK_MONOTONIC are on our timeline. By default they are those of the wall clock.
Result<void> IioBuffer::choose_clock() {
  constexpr const char* kClock = "current_timestamp_clock";
  if (!device_.attributes.has(kClock)) return {};
  static_cast<void>(device_.attributes.set(kClock, "monotonic"));
  is_monotonic_ = device_.attributes.text(kClock) == "monotonic";
  return {};
}

/// Takes the device's own trigger, if one is needed and none is chosen.
Result<void> IioBuffer::choose_trigger(const IioPaths& paths) {
  constexpr const char* kTrigger = "trigger/current_trigger";
  if (!device_.attributes.has(kTrigger)) return {};
  const Result<std::string> chosen = device_.attributes.text(kTrigger);
  if (chosen && !chosen->empty()) return {};
  const std::string number = device_.id.substr(std::string_view("iio:device").size());
  const std::string own = fmt::format("{}-dev{}", device_.name, number);
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(paths.devices, failed)) {
    if (!entry.path().filename().string().starts_with("trigger")) continue;
    if (IioAttributes(entry.path()).text("name") == own)
      return device_.attributes.set(kTrigger, own);
  }
  return fail(ErrorCode::kConfig,
              fmt::format("{}: no trigger, and none named {}: connect its interrupt, or write the "
                          "name of a trigger to {}",
                          device_.title(), own, (device_.attributes.folder() / kTrigger).string()));
}

Result<void> IioBuffer::choose_elements(IioQuantities wanted) {
  std::vector<std::string> names{"in_timestamp"};
  const auto add = [&](std::string_view quantity) {
    for (std::string& name : channels_of(quantity)) names.push_back(std::move(name));
  };
  if (wanted.rate) add("anglvel");
  if (wanted.acceleration) add("accel");
  if (Result<void> disabled = disable_all_but(device_, names); !disabled) return disabled;

  std::vector<Channel> channels;
  for (const std::string& name : names) {
    Result<Channel> channel = enable_channel(device_, name);
    if (!channel) return tl::unexpected(channel.error());
    channels.push_back(std::move(*channel));
  }
  std::ranges::sort(channels, {}, &Channel::index);
  std::vector<ScanElement> elements;
  elements.reserve(channels.size());
  for (const Channel& channel : channels) elements.push_back(channel.element);
  layout_ = ScanLayout(std::move(elements));
  stamp_index_ = place_of(channels, "in_timestamp");

  const auto place = [&](std::string_view quantity, std::optional<Placed>& placed) -> Result<void> {
    const Result<IioConversion> conversion = read_conversion(device_.attributes, quantity);
    if (!conversion) return tl::unexpected(conversion.error());
    placed = Placed{.axes = {}, .conversion = *conversion};
    const std::vector<std::string> axes = channels_of(quantity);
    for (std::size_t i = 0; i < axes.size(); ++i) placed->axes.at(i) = place_of(channels, axes[i]);
    return {};
  };
  Result<void> placed;
  if (wanted.rate) placed = place("anglvel", rate_);
  if (placed && wanted.acceleration) placed = place("accel", acceleration_);
  return placed;
}

Result<void> IioBuffer::read_available(const Clock& clock,
                                       const std::function<void(const IioScan&)>& sink) {
  constexpr std::size_t kMostScans = 64;
  std::vector<std::uint8_t> chunk(kMostScans * layout_.size());
  const ssize_t count = ::read(fd_.get(), chunk.data(), chunk.size());
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return {};
  if (count <= 0) {
    return fail(ErrorCode::kIo,
                fmt::format("{}: {}", device_.title(),
                            count == 0 ? "unplugged" : std::generic_category().message(errno)));
  }
  const Timestamp arrival = clock.now();
  pending_.insert(pending_.end(), chunk.begin(), chunk.begin() + count);
  std::size_t at = 0;
  for (; at + layout_.size() <= pending_.size(); at += layout_.size())
    forward(Bytes(pending_).subspan(at, layout_.size()), arrival, sink);
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(at));
  return {};
}

void IioBuffer::forward(Bytes scan, Timestamp arrival,
                        const std::function<void(const IioScan&)>& sink) {
  const auto stamp = stamp_of(layout_.value(scan, stamp_index_), arrival);
  if (!stamp) {
    ++counts_.stamps_refused;
    return;
  }
  const auto value = [&](const std::optional<Placed>& placed) -> std::optional<Eigen::Vector3d> {
    if (!placed) return std::nullopt;
    Eigen::Vector3d raw;
    for (std::size_t i = 0; i < placed->axes.size(); ++i) {
      raw[static_cast<Eigen::Index>(i)] =
          static_cast<double>(layout_.value(scan, placed->axes.at(i)));
    }
    return placed->conversion.apply(raw);
  };
  sink({.stamp = *stamp, .gyro_radps = value(rate_), .accel_mps2 = value(acceleration_)});
}

std::optional<Timestamp> IioBuffer::stamp_of(std::int64_t stamp_ns, Timestamp arrival) {
  constexpr Duration kAhead = std::chrono::milliseconds(20);  // a driver may predict its interrupt
  constexpr Duration kOldest = std::chrono::seconds(1);
  Timestamp stamp{Duration{stamp_ns}};
  if (is_monotonic_) {
    if (stamp > arrival + kAhead || stamp < arrival - kOldest) {
      wrong_stamps_ = fmt::format(
          "{}: its stamps are more than {:g} s before or {:g} s after the time of arrival",
          device_.title(), to_seconds(kOldest), to_seconds(kAhead));
      return std::nullopt;
    }
    stamp = std::min(stamp, arrival);
  } else {
    stamp = clock_.to_local(DeviceTime{.ns = static_cast<std::uint64_t>(stamp_ns)}, arrival);
    counts_.clock_restarts = clock_.restarts();
  }
  // The kernel's stamps differ; estimated ones may be equal.
  if (last_ && (is_monotonic_ ? stamp <= *last_ : stamp < *last_)) return std::nullopt;
  wrong_stamps_.clear();
  last_ = stamp;
  return stamp;
}

}  // namespace crepes
