/// The buffer of one IIO device: sets it up and reads scans from its character device.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "drivers/device_clock.hpp"
#include "drivers/iio/iio_devices.hpp"
#include "drivers/iio/scan_format.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// Each quantity is empty if it was not asked for.
struct IioScan {
  Timestamp stamp;
  std::optional<Eigen::Vector3d> gyro_radps;
  std::optional<Eigen::Vector3d> accel_mps2;
};

/// The quantities that a buffer delivers.
struct IioQuantities {
  bool rate = false;
  bool acceleration = false;
};

/// Sets the sampling rate of a quantity, "anglvel" or "accel", to the nearest that the device has,
/// and reads it back. Returns what is wrong with the rate that it then has; empty if nothing is.
[[nodiscard]] Result<std::string> set_sampling_rate(const IioDevice& device,
                                                    std::string_view quantity, double wanted_hz);

/// Sampling begins when this is opened and ends when it is destroyed.
class IioBuffer {
 public:
  /// Totals since the buffer was opened.
  struct Counts {
    std::uint64_t stamps_refused = 0;  ///< scans that are of another time, or of the past
    std::uint64_t clock_restarts = 0;  ///< of a clock other than CLOCK_MONOTONIC
  };

  /// Enables the wanted quantities and the stamp, and nothing else. Errors name the file.
  [[nodiscard]] static Result<IioBuffer> open(const IioPaths& paths, const IioDevice& device,
                                              IioQuantities wanted, double rate_hz);

  IioBuffer(IioBuffer&&) noexcept = default;
  IioBuffer& operator=(IioBuffer&&) noexcept = default;
  IioBuffer(const IioBuffer&) = delete;
  IioBuffer& operator=(const IioBuffer&) = delete;
  ~IioBuffer();

  [[nodiscard]] int fd() const { return fd_.get(); }
  /// Forwards the scans that are there, without waiting. An error means that the device is gone.
  [[nodiscard]] Result<void> read_available(const Clock& clock,
                                            const std::function<void(const IioScan&)>& sink);
  [[nodiscard]] const Counts& counts() const { return counts_; }
  /// One sentence on what is wrong with the stamps or the rate; empty if nothing is.
  [[nodiscard]] const std::string& fault() const {
    return wrong_stamps_.empty() ? wrong_rate_ : wrong_stamps_;
  }

 private:
  IioBuffer(UniqueFd fd, IioDevice device) : fd_(std::move(fd)), device_(std::move(device)) {}

  [[nodiscard]] Result<void> set_up(const IioPaths& paths, IioQuantities wanted, double rate_hz);
  void drop_old_scans() const;
  [[nodiscard]] Result<void> choose_clock();
  [[nodiscard]] Result<void> choose_rate(std::string_view quantity, double rate_hz);
  [[nodiscard]] Result<void> choose_trigger(const IioPaths& paths);
  [[nodiscard]] Result<void> choose_elements(IioQuantities wanted);
  [[nodiscard]] std::optional<Timestamp> stamp_of(std::int64_t stamp_ns, Timestamp arrival);
  void forward(Bytes scan, Timestamp arrival, const std::function<void(const IioScan&)>& sink);

  /// Where a quantity stands in a scan.
  struct Placed {
    std::array<std::size_t, 3> axes{};
    IioConversion conversion;
  };

  UniqueFd fd_;
  IioDevice device_;
  ScanLayout layout_;
  std::optional<Placed> rate_;
  std::optional<Placed> acceleration_;
  std::size_t stamp_index_ = 0;
  bool is_monotonic_ = false;
  DeviceClock clock_;
  std::optional<Timestamp> last_;
  std::vector<std::uint8_t> pending_;
  Counts counts_;
  std::string wrong_stamps_;
  std::string wrong_rate_;
};

}  // namespace crepes
