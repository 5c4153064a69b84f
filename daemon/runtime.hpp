/// Every queue and every thread of the daemon, on one screen.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "daemon/config_change.hpp"
#include "daemon/counters.hpp"
#include "daemon/estimator_stage.hpp"
#include "daemon/graph_stage.hpp"
#include "daemon/net_stage.hpp"
#include "daemon/recorder_stage.hpp"
#include "daemon/sensor_stages.hpp"
#include "daemon/watchdog.hpp"
#include "daemon/worker.hpp"
#include "drivers/sim/sim_clock.hpp"
#include "drivers/sim/sim_serial.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"

namespace crepes {

/// One robot, running from construction to destruction. Devices that fail do not end it: they are
/// reopened, and told in STATUS.
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

  /// Applies what can change live, and tells in STATUS what cannot. An error, and nothing changes:
  /// with what cannot change now the wanted settings would break a rule. For the thread that made
  /// this, as is `tell_reload_refused`.
  [[nodiscard]] Result<ConfigChange> reconfigure(Config wanted);
  /// Says in STATUS why there are no other settings, though they were asked for.
  void tell_reload_refused(const std::string& fault);

 private:
  struct CameraQueues {
    FrameQueue frames{1, Overflow::kDropOldest};  // only the newest picture matters
    FrameQueue used{2, Overflow::kDropOldest};    // memory on its way back to the camera
  };
  struct Loop {
    std::string name;
    std::vector<std::string> keys;  // a change of what begins with one of these concerns it
    Counter turns;
    SettingsQueue settings{1, Overflow::kDropOldest};
  };

  void open_simulation();
  void start_sensor(Sensor sensor, std::vector<std::string> keys);
  void start_camera(std::size_t index, const EventSink& sense);
  void use_simulated_devices(Config& wanted) const;
  /// A thread that runs `run(context, stop)`.
  template <class Run>
  void start(const std::string& name, std::vector<std::string> keys, Run run);
  [[nodiscard]] std::vector<QueueStatus> queue_status() const;

  Config config_;  // as at the start: threads read it, nobody changes it
  SimClock sim_clock_;
  const Clock& clock_;

  EventQueue events_{1024, Overflow::kDropOldest};  // about one second of everything
  Counter late_frames_;
  GraphQueue problems_{256, Overflow::kDropOldest};
  NetInbox outputs_{64};
  RecordQueue recorded_{4096, Overflow::kDropNewest};
  BoundedQueue<ConfigStatus> config_status_{1, Overflow::kDropOldest};
  std::deque<CameraQueues> cameras_;
  std::deque<PictureTap> picture_taps_;  // one a camera

  // The main thread's.
  Config in_force_;
  ConfigStatus reload_status_;

  std::optional<SimWorld> world_;
  std::deque<SimSerial> sim_devices_;
  std::deque<Loop> loops_;
  std::deque<Worker> workers_;  // last: joined before anything that they use dies
};

}  // namespace crepes
