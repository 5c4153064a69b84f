#include "daemon/runtime.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "daemon/camera_drivers.hpp"
#include "daemon/config_rules.hpp"
#include "daemon/logging.hpp"
#include "daemon/sim_stage.hpp"

namespace crepes {

template <class Run>
void Runtime::start(const std::string& name, std::vector<std::string> keys, Run run) {
  Loop& loop = loops_.emplace_back();
  loop.name = name;
  loop.keys = std::move(keys);
  const auto tell = [this](SensorStatus status) { outputs_.push(std::move(status)); };
  workers_.emplace_back(name,
                        [this, &loop, tell, run = std::move(run)](const std::stop_token& stop) {
                          run(StageContext{clock_, tell, loop.turns, loop.settings}, stop);
                        });
}

Runtime::Runtime(Config config, const Clock& machine)
    : config_(std::move(config)),
      sim_clock_(machine, config_.sim),
      clock_(config_.sim.enabled ? static_cast<const Clock&>(sim_clock_) : machine),
      cameras_(config_.cameras.size()) {
  if (config_.sim.enabled) open_simulation();
  for (std::size_t i = 0; i < cameras_.size(); ++i) picture_taps_.emplace_back();
  in_force_ = config_;
  reload_status_.since = clock_.now();
  // From here on there are threads.
  const bool records = !config_.recording.socket.empty();
  const auto sink = [this](Event event) { events_.push(std::move(event)); };
  const auto sense = [this, records, sink](Event event) {
    if (records) recorded_.push(event);
    sink(std::move(event));
  };

  start("estimator", {"swarm.", "imu.", "uwb.", "vision.", "estimator.", "graph.", "net."},
        [this](const StageContext& context, const std::stop_token& stop) {
          const EstimatorSinks sinks{
              .publish = [this](Outputs outputs) { outputs_.push(std::move(outputs)); },
              .solve = [this](GraphProblem problem) { problems_.push(std::move(problem)); },
              .inform = [this](EstimatorStatus status) { outputs_.push(std::move(status)); },
              .late_frames = late_frames_};
          run_estimator(config_, events_, sinks, context, stop);
        });
  start("graph", {"graph."},
        [this, sink](const StageContext& context, const std::stop_token& stop) {
          run_graph(config_.graph, problems_, sink, context, stop);
        });
  start("net", {"swarm.", "net.", "subscription."},
        [this, sink](const StageContext& context, const std::stop_token& stop) {
          const NetStage stage{.config = config_,
                               .inbox = outputs_,
                               .config_status = config_status_,
                               .on_report = sink,
                               .queues = [this] { return queue_status(); }};
          run_net(stage, context, stop);
        });
  for (SimSerial& device : sim_devices_) {
    start("sim serial", {},
          [this, &device](const StageContext& context, const std::stop_token& stop) {
            run_sim_serial(device, sim_clock_, context.turns, stop);
          });
  }
  start_sensor(imu_sensor(config_.imu, clock_, sense),
               {"imu.update_rate", "imu.port", "imu.baud", "imu.protocol", "imu.T_body_imu",
                "imu.accelerometer.", "imu.gyroscope."});
  start_sensor(uwb_sensor(config_.uwb, config_.swarm, clock_, sense),
               {"uwb.port", "uwb.baud", "uwb.max_range_m", "swarm.members"});
  for (std::size_t i = 0; i < cameras_.size(); ++i) start_camera(i, sense);
  if (!records) return;
  start("recorder", {""}, [this](const StageContext& context, const std::stop_token& stop) {
    run_recorder({config_, recorded_, picture_taps_}, context, stop);
  });
}

Runtime::~Runtime() {
  for (Worker& worker : workers_) worker.request_stop();
}

std::vector<Heartbeat> Runtime::heartbeats() const {
  std::vector<Heartbeat> beats;
  for (const Loop& loop : loops_) beats.push_back({loop.name, &loop.turns});
  return beats;
}

Result<ConfigChange> Runtime::reconfigure(Config wanted) {
  if (world_) use_simulated_devices(wanted);
  ConfigChange change = live_change(in_force_, wanted);
  std::string faults;
  for (const RuleFault& fault : validate(change.config))
    faults += (faults.empty() ? "" : "\n") + fault.key + ": " + fault.reason;
  if (!faults.empty()) return fail(ErrorCode::kConfig, "without a restart: " + faults);

  in_force_ = change.config;
  for (Loop& loop : loops_) {
    const auto concerns = [&loop](const std::string& key) {
      return std::ranges::any_of(loop.keys, [&](const auto& own) { return key.starts_with(own); });
    };
    // Behind the same name there may be another key by now.
    const bool has_key = !in_force_.net.key_file.empty() && concerns("net.key_file");
    if (has_key || std::ranges::any_of(change.live, concerns)) loop.settings.push(in_force_);
  }
  ++reload_status_.generation;
  reload_status_.since = clock_.now();
  reload_status_.restart = change.restart;
  reload_status_.fault.clear();
  config_status_.push(reload_status_);
  return change;
}

void Runtime::tell_reload_refused(const std::string& fault) {
  reload_status_.fault = fault;
  config_status_.push(reload_status_);
}

void Runtime::start_sensor(Sensor sensor, std::vector<std::string> keys) {
  const std::string name = sensor.name;
  start(name, std::move(keys),
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

/// What a configuration says of real ones does not count.
void Runtime::use_simulated_devices(Config& wanted) const {
  wanted.imu.port = config_.imu.port;
  wanted.imu.protocol = config_.imu.protocol;
  wanted.imu.T_body_imu = config_.imu.T_body_imu;
  wanted.imu.accelerometer = config_.imu.accelerometer;
  wanted.imu.gyroscope = config_.imu.gyroscope;
  wanted.uwb.port = config_.uwb.port;
}

void Runtime::start_camera(std::size_t index, const EventSink& sense) {
  const CameraConfig& camera = config_.cameras[index];
  CameraQueues& queues = cameras_[index];
  PictureTap& tap = picture_taps_[index];
  start(camera.name + " spots", {"vision."},
        [this, &camera, &queues, &tap, sense](const StageContext& context,
                                              const std::stop_token& stop) {
          const VisionStage stage{.camera_name = camera.name,
                                  .config = config_.vision,
                                  .frames = queues.frames,
                                  .used = queues.used,
                                  .tap = tap,
                                  .sink = sense};
          run_vision(stage, context, stop);
        });
  const OpenCamera open = world_ ? sim_camera(*world_, config_, index, sim_clock_)
                                 : real_camera(config_, index, clock_);
  start_sensor(camera_sensor(camera.name, open, clock_, queues.frames, queues.used), {});
}

std::vector<QueueStatus> Runtime::queue_status() const {
  std::vector<QueueStatus> status{{"events", events_.dropped()},
                                  {"late frames", late_frames_.value()},
                                  {"graph problems", problems_.dropped()},
                                  {"outputs", outputs_.dropped()},
                                  {"recording", recorded_.dropped()}};
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    status.push_back({config_.cameras[i].name + " frames", cameras_[i].frames.dropped()});
  return status;
}

}  // namespace crepes
