#include "daemon/runtime.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "config/schema/estimator_slice.hpp"
#include "config/schema/validation.hpp"
#include "daemon/devices/camera_drivers.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/stages/sim_stage.hpp"

namespace crepes {

template <class Run>
void Runtime::start(const std::string& name, Run run) {
  Loop& loop = loops_.emplace_back();
  loop.name = name;
  const auto report = [this](SensorStatus status) { outputs_.push(std::move(status)); };
  workers_.emplace_back(name,
                        [this, &loop, report, run = std::move(run)](const std::stop_token& stop) {
                          run(StageContext{clock_, report, loop.iterations}, stop);
                        });
}

Runtime::Runtime(Config config, const Clock& machine)
    : config_(std::move(config)),
      sim_clock_(machine, config_.sim),
      clock_(config_.sim.enabled ? static_cast<const Clock&>(sim_clock_) : machine),
      estimator_settings_(estimator_settings(config_)),
      graph_settings_(config_.graph),
      net_settings_(net_settings(config_)),
      imu_settings_(imu_sensor_settings(config_)),
      uwb_settings_(uwb_sensor_settings(config_)),
      recorder_settings_(config_) {
  if (config_.sim.enabled) open_simulation();
  for (const CameraConfig& camera : config_.cameras) {
    cameras_.emplace_back(config_.vision, camera.device.light_settings());
    picture_taps_.emplace_back();
  }
  active_config_ = config_;
  update_settings();
  reload_status_.since = clock_.now();
  // From here on there are threads.
  const bool records = !config_.recording.socket.empty();
  const auto sink = [this](Event event) { events_.push(std::move(event)); };
  const auto sense = [this, records, sink](Event event) {
    if (records) recorded_.push(event);
    sink(std::move(event));
  };

  start("estimator", [this](const StageContext& context, const std::stop_token& stop) {
    const EstimatorSinks sinks{
        .publish = [this](Outputs outputs) { outputs_.push(std::move(outputs)); },
        .solve_team = [this](TeamProblem problem) { problems_.push(std::move(problem)); },
        .publish_status = [this](EstimatorStatus status) { outputs_.push(std::move(status)); },
        .sight =
            [this](PictureRobots sighting) {
              cameras_[sighting.camera].boards.push(sighting);
              if (!config_.recording.socket.empty()) sightings_.push(std::move(sighting));
            },
        .late_frames = late_frames_};
    run_estimator(estimator_settings_, events_, sinks, context, stop);
  });
  start("graph", [this, sink](const StageContext& context, const std::stop_token& stop) {
    run_graph(graph_settings_, problems_, sink, context, stop);
  });
  start("net", [this, sink](const StageContext& context, const std::stop_token& stop) {
    const NetStage stage{.settings = net_settings_,
                         .inbox = outputs_,
                         .config_status = config_status_,
                         .on_report = sink,
                         .queues = [this] { return queue_status(); }};
    run_net(stage, context, stop);
  });
  for (SimSerial& device : sim_devices_) {
    start("sim serial", [this, &device](const StageContext& context, const std::stop_token& stop) {
      run_sim_serial(device, sim_clock_, context.iterations, stop);
    });
  }
  start_sensor("imu",
               sensor_source(imu_settings_, [this, sense](const ImuSensorSettings& settings) {
                 return imu_sensor(settings, clock_, sense, imu_device_);
               }));
  start_sensor("uwb",
               sensor_source(uwb_settings_, [this, sense](const UwbSensorSettings& settings) {
                 return uwb_sensor(settings, clock_, sense, uwb_device_);
               }));
  for (std::size_t i = 0; i < cameras_.size(); ++i) start_camera(i, sense);
  if (!records) return;
  start("recorder", [this](const StageContext& context, const std::stop_token& stop) {
    run_recorder({recorder_settings_, recorded_, picture_taps_, sightings_}, context, stop);
  });
}

Runtime::~Runtime() {
  for (Worker& worker : workers_) worker.request_stop();
}

std::vector<Heartbeat> Runtime::heartbeats() const {
  std::vector<Heartbeat> beats;
  for (const Loop& loop : loops_) beats.push_back({loop.name, &loop.iterations});
  return beats;
}

Result<ConfigChange> Runtime::reconfigure(Config wanted) {
  if (world_) use_simulated_devices(wanted);
  ConfigChange change = plan_reload(active_config_, wanted);
  std::string faults;
  for (const RuleFault& fault : validate(change.config))
    faults += fmt::format("{}{}: {}", faults.empty() ? "" : "\n", fault.key, fault.reason);
  if (!faults.empty()) return fail(ErrorCode::kConfig, "without a restart: " + faults);

  active_config_ = change.config;
  update_settings();
  ++reload_status_.generation;
  reload_status_.since = clock_.now();
  reload_status_.restart = change.restart;
  reload_status_.fault.clear();
  config_status_.push(reload_status_);
  return change;
}

/// Sends each stage its own settings, if they have changed.
void Runtime::update_settings() {
  estimator_settings_.update(estimator_settings(active_config_));
  graph_settings_.update(active_config_.graph);
  net_settings_.update(net_settings(active_config_));
  imu_settings_.update(imu_sensor_settings(active_config_));
  uwb_settings_.update(uwb_sensor_settings(active_config_));
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    cameras_[i].settings.update(active_config_.vision);
    const LightSettings light = active_config_.cameras[i].device.light_settings();
    cameras_[i].light_settings.update(light);
    cameras_[i].light.update(light);
  }
  recorder_settings_.update(active_config_);
}

void Runtime::report_refused_reload(const std::string& fault) {
  reload_status_.fault = fault;
  config_status_.push(reload_status_);
}

void Runtime::start_sensor(const std::string& name, const SensorSource& source) {
  start(name, [source](const StageContext& context, const std::stop_token& stop) {
    run_sensor(source, context, stop);
  });
}

/// Creates simulated devices; the readers open their ports and never the configured ones. The
/// simulated IMU is a WitMotion without errors, aligned with the body.
void Runtime::open_simulation() {
  config_.imu.device.protocol = ImuProtocol::kWitMotion;
  config_.imu.device.T_body_imu = {};
  config_.imu.device.accelerometer = {};
  config_.imu.device.gyroscope = {};
  world_.emplace(config_.sim);
  const auto connect = [this](Result<SimSerial> device, std::string& port) {
    port.clear();
    if (!device) return log_message(LogLevel::kError, "simulation: " + device.error().message);
    port = device->path();
    sim_devices_.push_back(std::move(*device));
  };
  connect(open_sim_imu(*world_, config_), config_.imu.device.port);
  connect(open_sim_uwb(*world_, config_), config_.uwb.device.port);
}

/// A simulation ignores the settings of real devices.
void Runtime::use_simulated_devices(Config& wanted) const {
  wanted.imu.device.port = config_.imu.device.port;
  wanted.imu.device.protocol = config_.imu.device.protocol;
  wanted.imu.device.T_body_imu = config_.imu.device.T_body_imu;
  wanted.imu.device.accelerometer = config_.imu.device.accelerometer;
  wanted.imu.device.gyroscope = config_.imu.device.gyroscope;
  wanted.uwb.device.port = config_.uwb.device.port;
}

void Runtime::start_camera(std::size_t index, const EventSink& sense) {
  const std::string& name = config_.cameras[index].calibration.name;
  const bool is_calibrated = config_.cameras[index].calibration.calibrated;
  CameraQueues& queues = cameras_[index];
  PictureTap& tap = picture_taps_[index];
  start(name + " spots", [name, is_calibrated, &queues, &tap, sense](const StageContext& context,
                                                                     const std::stop_token& stop) {
    const VisionStage stage{.camera_name = name,
                            .is_calibrated = is_calibrated,
                            .settings = queues.settings,
                            .light_settings = queues.light_settings,
                            .light = queues.light,
                            .boards = queues.boards,
                            .frames = queues.frames,
                            .recycled = queues.recycled,
                            .tap = tap,
                            .sink = sense};
    run_vision(stage, context, stop);
  });
  const OpenCamera open = world_ ? sim_camera(*world_, config_, index, sim_clock_)
                                 : real_camera(config_, index, clock_);
  start_sensor(name, fixed_sensor(camera_sensor(name, open, queues.light, clock_, queues.frames,
                                                queues.recycled)));
}

std::vector<QueueStatus> Runtime::queue_status() const {
  std::vector<QueueStatus> status{{"events", events_.dropped()},
                                  {"late frames", late_frames_.value()},
                                  {"graph problems", problems_.dropped()},
                                  {"outputs", outputs_.dropped()},
                                  {"recording", recorded_.dropped()}};
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    status.push_back(
        {config_.cameras[i].calibration.name + " frames", cameras_[i].frames.dropped()});
  }
  return status;
}

}  // namespace crepes
