/// Every queue and every thread of the daemon, on one screen.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "daemon/counters.hpp"
#include "daemon/estimator_stage.hpp"
#include "daemon/graph_stage.hpp"
#include "daemon/net_stage.hpp"
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

 private:
  struct CameraQueues {
    FrameQueue frames{1, Overflow::kDropOldest};  // only the newest picture matters
    FrameQueue used{2, Overflow::kDropOldest};    // memory on its way back to the camera
  };
  struct Loop {
    std::string name;
    Counter turns;
  };

  void open_simulation();
  void start_sensor(Sensor sensor);
  void start_camera(std::size_t index);
  /// A thread that runs `run(context, stop)`.
  template <class Run>
  void start(const std::string& name, Run run);
  [[nodiscard]] std::vector<QueueStatus> queue_status() const;

  Config config_;
  SimClock sim_clock_;
  const Clock& clock_;

  EventQueue events_{1024, Overflow::kDropOldest};  // about one second of everything
  GraphQueue problems_{256, Overflow::kDropOldest};
  NetInbox outputs_{64};
  std::deque<CameraQueues> cameras_;

  std::optional<SimWorld> world_;
  std::deque<SimSerial> sim_devices_;
  std::deque<Loop> loops_;
  std::deque<Worker> workers_;  // last: joined before anything that they use dies
};

}  // namespace crepes
