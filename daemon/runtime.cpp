#include "daemon/runtime.hpp"

#include <memory>
#include <utility>

#include "daemon/camera_drivers.hpp"
#include "daemon/logging.hpp"
#include "daemon/sim_stage.hpp"

namespace crepes {

template <class Run>
void Runtime::start(const std::string& name, Run run) {
  Loop& loop = loops_.emplace_back();
  loop.name = name;
  const auto tell = [this](SensorStatus status) { outputs_.push(std::move(status)); };
  workers_.emplace_back(name,
                        [this, &loop, tell, run = std::move(run)](const std::stop_token& stop) {
                          run(StageContext{clock_, tell, loop.turns}, stop);
                        });
}

Runtime::Runtime(Config config, const Clock& machine)
    : config_(std::move(config)),
      sim_clock_(machine, config_.sim),
      clock_(config_.sim.enabled ? static_cast<const Clock&>(sim_clock_) : machine),
      cameras_(config_.cameras.size()) {
  if (config_.sim.enabled) open_simulation();
  // From here on threads read config_: nobody changes it.
  const auto sink = [this](Event event) { events_.push(std::move(event)); };

  start("estimator", [this](const StageContext& context, const std::stop_token& stop) {
    const EstimatorSinks sinks{
        .publish = [this](Outputs outputs) { outputs_.push(std::move(outputs)); },
        .solve = [this](GraphProblem problem) { problems_.push(std::move(problem)); },
        .inform = [this](EstimatorStatus status) { outputs_.push(std::move(status)); }};
    run_estimator(config_, events_, sinks, context.clock, context.turns, stop);
  });
  start("graph", [this, sink](const StageContext& context, const std::stop_token& stop) {
    run_graph(config_.graph, problems_, sink, context.turns, stop);
  });
  start("net", [this, sink](const StageContext& context, const std::stop_token& stop) {
    const NetStage stage{.config = config_, .inbox = outputs_, .on_report = sink, .queues = [this] {
                           return queue_status();
                         }};
    run_net(stage, context.clock, context.turns, stop);
  });
  for (SimSerial& device : sim_devices_) {
    start("sim serial", [this, &device](const StageContext& context, const std::stop_token& stop) {
      run_sim_serial(device, sim_clock_, context.turns, stop);
    });
  }
  start_sensor(imu_sensor(config_.imu, clock_, sink));
  start_sensor(uwb_sensor(config_.uwb, config_.swarm, clock_, sink));
  for (std::size_t i = 0; i < cameras_.size(); ++i) start_camera(i);
}

Runtime::~Runtime() {
  for (Worker& worker : workers_) worker.request_stop();
}

std::vector<Heartbeat> Runtime::heartbeats() const {
  std::vector<Heartbeat> beats;
  for (const Loop& loop : loops_) beats.push_back({loop.name, &loop.turns});
  return beats;
}

void Runtime::start_sensor(Sensor sensor) {
  const std::string name = sensor.name;
  start(name,
        [sensor = std::move(sensor)](const StageContext& context, const std::stop_token& stop) {
          run_sensor(sensor, context, stop);
        });
}

/// Devices whose ports the readers are to open instead of the configured ones. The inertial sensor
/// there is a WitMotion without faults, mounted straight.
void Runtime::open_simulation() {
  config_.imu.protocol = ImuProtocol::kWitMotion;
  config_.imu.T_body_imu = {};
  config_.imu.accelerometer = {};
  config_.imu.gyroscope = {};
  world_.emplace(config_.sim);
  const auto connect = [this](Result<SimSerial> device, std::string& port) {
    if (!device) return log_message(LogLevel::kError, "simulation: " + device.error().message);
    port = device->path();
    sim_devices_.push_back(std::move(*device));
  };
  connect(open_sim_imu(*world_, config_), config_.imu.port);
  connect(open_sim_uwb(*world_, config_), config_.uwb.port);
}

void Runtime::start_camera(std::size_t index) {
  const CameraConfig& camera = config_.cameras[index];
  CameraQueues& queues = cameras_[index];
  start(camera.name + " spots",
        [this, &camera, &queues](const StageContext& context, const std::stop_token& stop) {
          const VisionStage stage{.camera_name = camera.name,
                                  .config = config_.vision,
                                  .frames = queues.frames,
                                  .used = queues.used,
                                  .sink = [this](Event e) { events_.push(std::move(e)); }};
          run_vision(stage, context, stop);
        });
  const OpenCamera open = world_ ? sim_camera(*world_, config_, index, sim_clock_)
                                 : real_camera(config_, index, clock_);
  start_sensor(camera_sensor(camera.name, open, clock_, queues.frames, queues.used));
}

std::vector<QueueStatus> Runtime::queue_status() const {
  std::vector<QueueStatus> status{{"events", events_.dropped()},
                                  {"graph problems", problems_.dropped()},
                                  {"outputs", outputs_.dropped()}};
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    status.push_back({config_.cameras[i].name + " frames", cameras_[i].frames.dropped()});
  return status;
}

}  // namespace crepes
