/// An inertial sensor of the Linux kernel: the IIO devices of its gyroscope and accelerometer.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/iio/iio_buffer.hpp"
#include "drivers/iio/triad_pairing.hpp"
#include "drivers/imu/imu_reading.hpp"

namespace crepes {

/// Both in one device, or in one each. An accelerometer without a buffer (BMI088) is read whenever
/// rates arrive. Samples are in the axes of the board that the mount matrices name.
class IioImu {
 public:
  /// Totals since the sensor was opened.
  struct Counts {
    ImuCounts samples;
    std::uint64_t unpaired = 0;        ///< rates without an acceleration before and after them
    std::uint64_t stamps_refused = 0;  ///< see IioBuffer
  };

  /// `port` as for `choose_iio_imu`. kNotFound: there is no such sensor now. `clock` must outlive
  /// this.
  [[nodiscard]] static Result<IioImu> open(const IioPaths& paths, std::string_view port,
                                           double rate_hz, const Clock& clock);

  /// Waits at most `timeout` and forwards the samples that are complete. An error means that a
  /// device is gone.
  [[nodiscard]] Result<void> read_once(std::chrono::milliseconds timeout,
                                       const std::function<void(const ImuSample&)>& sink);

  [[nodiscard]] Counts counts() const;
  /// One sentence on what is wrong, if anything.
  [[nodiscard]] std::optional<std::string> diagnosis() const;

 private:
  /// An accelerometer that is read number by number.
  struct Polled {
    IioDevice device;
    IioConversion conversion;
    std::string wrong_rate = {};
  };

  IioImu(IioBuffer rates, double rate_hz, const Clock& clock);

  [[nodiscard]] Result<void> add_accelerometer(const IioPaths& paths, const IioDevice& device,
                                               double rate_hz);
  [[nodiscard]] Result<void> read_polled();
  void forward(const ImuSample& sample, const std::function<void(const ImuSample&)>& sink);

  IioBuffer rates_;  ///< and accelerations, if both are of one device
  std::optional<IioBuffer> accelerations_;
  std::optional<Polled> polled_;
  TriadPairing pairing_;
  const Clock* clock_;
  DeviceClock no_clock_;  ///< scans are stamped already
  ImuCounts counts_;
};

}  // namespace crepes
