/// Every queue and every thread of the daemon, on one screen.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "config/reloading/config_change.hpp"
#include "config/schema/config.hpp"
#include "daemon/devices/camera_sensor.hpp"
#include "daemon/devices/serial_sensors.hpp"
#include "daemon/recording/recorder_stage.hpp"
#include "daemon/service/watchdog.hpp"
#include "daemon/stages/counters.hpp"
#include "daemon/stages/estimator_stage.hpp"
#include "daemon/stages/graph_stage.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/net_stage.hpp"
#include "daemon/stages/picture_tap.hpp"
#include "daemon/stages/sensor_stage.hpp"
#include "daemon/stages/vision_stage.hpp"
#include "daemon/stages/worker.hpp"
#include "drivers/serial/device_name.hpp"
#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/sim_serial.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/clock.hpp"

namespace crepes {

/// One robot, running from construction to destruction. A device that fails is reported in STATUS
/// and opened again.
class Runtime {
 public:
  /// `config` must be valid; `machine` must outlive this.
  Runtime(Config config, const Clock& machine);
  Runtime(const Runtime&) = delete;
  Runtime& operator=(const Runtime&) = delete;
  Runtime(Runtime&&) = delete;
  Runtime& operator=(Runtime&&) = delete;
  /// Stops all threads and waits for them.
  ~Runtime();

  /// For the watchdog; valid while this lives.
  [[nodiscard]] std::vector<Heartbeat> heartbeats() const;

  /// Applies the live settings, and reports in STATUS those that need a restart. Returns an error
  /// and changes nothing if the result would break a rule. Only for the thread that constructed
  /// this, like `report_refused_reload`.
  [[nodiscard]] Result<ConfigChange> reconfigure(Config wanted);
  /// Publishes in STATUS why a reload was refused.
  void report_refused_reload(const std::string& fault);

 private:
  struct CameraQueues {
    CameraQueues(const VisionConfig& vision, const LightSettings& initial)
        : settings(vision), light_settings(initial), light(initial) {}
    LiveSettings<VisionConfig> settings;
    LiveSettings<LightSettings> light_settings;  // for the vision stage
    LiveLight light;                             // for the camera
    PictureRobotsQueue boards{16, Overflow::kDropOldest};
    FrameQueue frames{1, Overflow::kDropOldest};    // only the newest picture matters
    FrameQueue recycled{2, Overflow::kDropOldest};  // buffers on their way back to the camera
  };
  struct Loop {
    std::string name;
    Counter iterations;
  };

  void open_simulation();
  void update_settings();
  void start_sensor(const std::string& name, const SensorSource& source);
  void start_camera(std::size_t index, const EventSink& sense);
  void use_simulated_devices(Config& wanted) const;
  /// A thread that runs `run(context, stop)`.
  template <class Run>
  void start(const std::string& name, Run run);
  [[nodiscard]] std::vector<QueueStatus> queue_status() const;

  Config config_;  // as at the start: threads read it, and nothing changes it
  SimClock sim_clock_;
  const Clock& clock_;

  EventQueue events_{1024, Overflow::kDropOldest};  // about one second of everything
  Counter late_frames_;
  GraphQueue problems_{256, Overflow::kDropOldest};
  NetInbox outputs_{64};
  RecordQueue recorded_{4096, Overflow::kDropNewest};
  PictureRobotsQueue sightings_{
      64, Overflow::kDropOldest};  // a quarter of a second; only the newest matter
  BoundedQueue<ConfigStatus> config_status_{1, Overflow::kDropOldest};
  std::deque<CameraQueues> cameras_;
  std::deque<PictureTap> picture_taps_;  // one a camera

  // The settings of each stage, made from the configuration; see `update_settings`.
  LiveSettings<EstimatorSettings> estimator_settings_;
  LiveSettings<GraphConfig> graph_settings_;
  LiveSettings<NetSettings> net_settings_;
  LiveSettings<ImuSensorSettings> imu_settings_;
  LiveSettings<UwbSensorSettings> uwb_settings_;
  LiveSettings<Config> recorder_settings_;

  DeviceName imu_device_{"", kSerialById};  // the sensor's thread's
  DeviceName uwb_device_{"", kSerialById};

  // The main thread's.
  Config active_config_;
  ConfigStatus reload_status_;

  std::optional<SimWorld> world_;
  std::deque<SimSerial> sim_devices_;
  std::deque<Loop> loops_;
  std::deque<Worker> workers_;  // last: joined before anything that they use is destroyed
};

}  // namespace crepes
