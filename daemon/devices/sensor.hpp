/// A sensor as its stage sees it, independent of its kind.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "drivers/base/sensor_totals.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// A device that is open.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  Device(Device&&) = delete;
  Device& operator=(Device&&) = delete;
  virtual ~Device() = default;

  /// Waits at most `timeout` and forwards what arrives. Returns the number of measurements. An
  /// error means that the device is gone.
  [[nodiscard]] virtual Result<std::size_t> read_once(std::chrono::milliseconds timeout) = 0;
  /// Whether settings wait that change while it is open, as a camera's light.
  [[nodiscard]] virtual bool has_new_settings() const { return false; }
  /// Applies them. May take seconds, so it is called on a thread of its own, while nothing else is.
  virtual void apply_settings() {}
  /// Since it was opened.
  [[nodiscard]] virtual SensorTotals counters() const = 0;
  /// One sentence on what is wrong with the data, if anything.
  [[nodiscard]] virtual std::optional<std::string> diagnosis() const = 0;
};

struct Sensor {
  std::string name;
  std::function<Result<std::unique_ptr<Device>>()> open;  ///< may be called repeatedly
  std::string silence_hint;  ///< what to check when the open device delivers nothing
};

}  // namespace crepes
