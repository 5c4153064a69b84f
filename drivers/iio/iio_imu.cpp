#include "drivers/iio/iio_imu.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <array>
#include <cerrno>
#include <utility>

#include "drivers/base/io_failure.hpp"

namespace crepes {
namespace {

/// Over which accelerations are interpolated; a buffer is read every few milliseconds.
Duration longest_gap(double rate_hz) { return from_seconds(4.0 / rate_hz + 0.010); }

bool has_buffer(const IioDevice& device, std::string_view quantity) {
  return device.attributes.has("buffer/enable") &&
         device.attributes.has(fmt::format("scan_elements/in_{}_x_en", quantity));
}

/// Waits until any of them has data, or is gone.
Result<void> wait_for_data(std::array<pollfd, 2>& waiting, std::size_t count,
                           std::chrono::milliseconds timeout) {
  if (::poll(waiting.data(), count, static_cast<int>(timeout.count())) >= 0 || errno == EINTR)
    return {};
  return io_failure("poll");
}

}  // namespace

IioImu::IioImu(IioBuffer rates, double rate_hz, const Clock& clock)
    : rates_(std::move(rates)), pairing_(longest_gap(rate_hz)), clock_(&clock) {}

Result<IioImu> IioImu::open(const IioPaths& paths, std::string_view port, double rate_hz,
                            const Clock& clock) {
  const Result<IioImuDevices> devices = choose_iio_imu(paths, port);
  if (!devices) return tl::unexpected(devices.error());
  const bool is_one = devices->gyro.id == devices->accelerometer.id;
  if (!has_buffer(devices->gyro, "anglvel")) {
    return fail(ErrorCode::kConfig,
                devices->gyro.title() + ": its driver has no buffer; is its interrupt connected?");
  }
  Result<IioBuffer> rates =
      IioBuffer::open(paths, devices->gyro, {.rate = true, .acceleration = is_one}, rate_hz);
  if (!rates) return tl::unexpected(rates.error());
  IioImu imu(std::move(*rates), rate_hz, clock);
  if (!is_one) {
    const Result<void> added = imu.add_accelerometer(paths, devices->accelerometer, rate_hz);
    if (!added) return tl::unexpected(added.error());
  }
  return imu;
}

Result<void> IioImu::add_accelerometer(const IioPaths& paths, const IioDevice& device,
                                       double rate_hz) {
  if (has_buffer(device, "accel")) {
    return IioBuffer::open(paths, device, {.acceleration = true}, rate_hz)
        .map([&](IioBuffer&& buffer) { accelerations_.emplace(std::move(buffer)); });
  }
  const Result<IioConversion> conversion = read_conversion(device.attributes, "accel");
  if (!conversion) return tl::unexpected(conversion.error());
  return set_sampling_rate(device, "accel", rate_hz).map([&](const std::string& wrong_rate) {
    polled_ = Polled{device, *conversion, wrong_rate};
  });
}

Result<void> IioImu::read_once(std::chrono::milliseconds timeout,
                               const std::function<void(const ImuSample&)>& sink) {
  std::array<pollfd, 2> waiting{};
  waiting[0] = {.fd = rates_.fd(), .events = POLLIN, .revents = 0};
  if (accelerations_) waiting[1] = {.fd = accelerations_->fd(), .events = POLLIN, .revents = 0};
  Result<void> waited = wait_for_data(waiting, accelerations_ ? 2 : 1, timeout);
  if (!waited) return waited;

  bool has_rates = false;
  Result<void> read;
  if (waiting[0].revents != 0) {
    read = rates_.read_available(*clock_, [&](const IioScan& scan) {
      has_rates = true;
      if (scan.accel_mps2) return forward({scan.stamp, *scan.gyro_radps, *scan.accel_mps2}, sink);
      pairing_.add_rate({scan.stamp, *scan.gyro_radps});
    });
  }
  if (read && accelerations_ && waiting[1].revents != 0) {
    read = accelerations_->read_available(*clock_, [&](const IioScan& scan) {
      pairing_.add_acceleration({scan.stamp, *scan.accel_mps2});
    });
  }
  if (read && has_rates && polled_) read = read_polled();
  for (const ImuSample& sample : pairing_.drain()) forward(sample, sink);
  return read;
}

/// Stamped in the middle of the three readings.
Result<void> IioImu::read_polled() {
  constexpr std::array kNames{"in_accel_x_raw", "in_accel_y_raw", "in_accel_z_raw"};
  const Timestamp begin = clock_->now();
  Eigen::Vector3d raw;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const Result<double> number = polled_->device.attributes.number(kNames.at(i));
    if (!number) return tl::unexpected(number.error());
    raw[static_cast<Eigen::Index>(i)] = *number;
  }
  pairing_.add_acceleration({begin + (clock_->now() - begin) / 2, polled_->conversion.apply(raw)});
  return {};
}

void IioImu::forward(const ImuSample& sample, const std::function<void(const ImuSample&)>& sink) {
  const ImuReading reading{.verdict = ImuVerdict::kSample,
                           .gyro_radps = sample.gyro_radps,
                           .accel_mps2 = sample.accel_mps2};
  forward_sample(reading, sample.stamp, no_clock_, counts_, sink);
}

IioImu::Counts IioImu::counts() const {
  Counts counts{.samples = counts_,
                .unpaired = pairing_.unpaired(),
                .stamps_refused = rates_.counts().stamps_refused};
  counts.samples.clock_restarts = rates_.counts().clock_restarts;
  if (!accelerations_) return counts;
  counts.stamps_refused += accelerations_->counts().stamps_refused;
  counts.samples.clock_restarts += accelerations_->counts().clock_restarts;
  return counts;
}

std::optional<std::string> IioImu::diagnosis() const {
  if (!rates_.fault().empty()) return rates_.fault();
  if (accelerations_ && !accelerations_->fault().empty()) return accelerations_->fault();
  if (polled_ && !polled_->wrong_rate.empty()) return polled_->wrong_rate;
  return std::nullopt;
}

}  // namespace crepes
