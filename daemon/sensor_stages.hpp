/// The loops around devices: open, read, report what is wrong, come back.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "daemon/bounded_queue.hpp"
#include "daemon/counters.hpp"
#include "drivers/camera/camera.hpp"
#include "drivers/serial/device_name.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/event.hpp"
#include "estimator/core/outputs.hpp"

namespace crepes {

using EventSink = std::function<void(Event)>;
using StatusSink = std::function<void(SensorStatus)>;

/// A device that is open.
class Device {
 public:
  Device() = default;
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;
  Device(Device&&) = delete;
  Device& operator=(Device&&) = delete;
  virtual ~Device() = default;

  /// Waits at most so long and hands on what comes; how many measurements those were. An error
  /// means that the device is gone.
  [[nodiscard]] virtual Result<std::size_t> read_once(std::chrono::milliseconds timeout) = 0;
  /// Since it was opened.
  [[nodiscard]] virtual SensorTotals counters() const = 0;
  /// One sentence on what is wrong with what comes in, if anything.
  [[nodiscard]] virtual std::optional<std::string> diagnosis() const = 0;
};

/// A sensor as a stage sees it; `open` may be called again and again.
struct Sensor {
  std::string name;
  std::function<Result<std::unique_ptr<Device>>()> open;
  std::string when_silent;  ///< what to look at when the open device says nothing
  std::function<Sensor(const Config&)> renewed{};  ///< the same with other settings
};

/// Settings on their way to a stage, of which the newest count.
using SettingsQueue = BoundedQueue<Config>;

/// What every stage is given. All must outlive it.
struct StageContext {
  const Clock& clock;
  StatusSink tell;  ///< thread-safe
  Counter& turns;   ///< grows at least once in 200 ms
  SettingsQueue& settings;
};

/// Reads a sensor until `stop`; reopens it after 0.1 s, at last 5 s, when it fails, and at once
/// when there are new settings. One that is not there (kNotFound) is looked for every 0.1 s.
void run_sensor(Sensor sensor, const StageContext& context, const std::stop_token& stop);

/// The ranging module and the inertial sensor of the configuration, on their serial ports. Links in
/// `by_id` tell which device is the same as before.
[[nodiscard]] Sensor uwb_sensor(const UwbConfig& config, const SwarmConfig& swarm,
                                const Clock& clock, const EventSink& sink,
                                const std::string& by_id = kSerialById);
[[nodiscard]] Sensor imu_sensor(const ImuConfig& config, const Clock& clock, const EventSink& sink,
                                const std::string& by_id = kSerialById);

using FrameQueue = BoundedQueue<Frame>;
using OpenCamera = std::function<Result<std::unique_ptr<Camera>>()>;

/// A camera whose frames go to `frames`; those in `used` are given back to it.
[[nodiscard]] Sensor camera_sensor(const std::string& name, const OpenCamera& open,
                                   const Clock& clock, FrameQueue& frames, FrameQueue& used);

/// For whoever asks to see a picture now and then: it is copied when one is wanted, and only then.
struct PictureTap {
  struct Wish {};
  BoundedQueue<Wish> wanted{1, Overflow::kDropNewest};
  BoundedQueue<Frame> taken{1, Overflow::kDropNewest};
};

/// What the vision thread of one camera works on. All references must outlive it.
struct VisionStage {
  std::string camera_name;
  VisionConfig config;
  FrameQueue& frames;
  FrameQueue& used;
  PictureTap& tap;
  EventSink sink;
};

/// Finds the spots of frames until `stop`.
void run_vision(const VisionStage& stage, const StageContext& context, const std::stop_token& stop);

}  // namespace crepes
