#include "daemon/ctl/replay/virtual_swarm.hpp"

#include <algorithm>
#include <string>

#include "daemon/ctl/replay/cpu_timer.hpp"
#include "drivers/camera/image_folder.hpp"

namespace crepes {
namespace {

// The time that a graph solution takes on a robot; the paper needs 3 ms.
constexpr double kGraphLatency = 0.005;  // s
constexpr double kMaxIdError = 0.05;  // rad; a bearing with a larger error belongs to another robot
constexpr double kClockSamplePeriod = 1.0;  // s
constexpr std::size_t kMaxHeld = 1024;      // the daemon's queue of events

NetworkModel network_model(NetworkModel recorded, const ReplayOptions& options) {
  recorded.loss = options.loss.value_or(recorded.loss);
  return recorded;
}

struct ShiftStamp {
  Duration by;
  void operator()(ReceivedReport& /*already on our clock*/) const {}
  template <class Reading>
  void operator()(Reading& reading) const {
    reading.stamp += by;
  }
};

bool is_own_reading(const Event& event) {
  return std::holds_alternative<ImuSample>(event) || std::holds_alternative<UwbRange>(event) ||
         std::holds_alternative<SpotFrame>(event);
}

bool concerns(const SensorDelays& delays, const SwarmRobot& robot) {
  return delays.robots.empty() || std::ranges::any_of(delays.robots, [&](const auto& delayed) {
           return is_named(robot, delayed);
         });
}

bool is_tick(const VirtualInput& input) {
  const auto* const event = std::get_if<Event>(&input);
  return event != nullptr && std::holds_alternative<Tick>(*event);
}

bool is_member(const VirtualRobot& robot, RobotId id) {
  return id != robot.id() && std::ranges::any_of(robot.recording.config.swarm.members,
                                                 [id](const auto& m) { return m.id == id; });
}

}  // namespace

VirtualSwarm::VirtualSwarm(SwarmDataset dataset, const std::optional<SwarmTruth>& truth,
                           const ReplayOptions& options, const ReplaySinks& sinks)
    : manifest_(std::move(dataset.manifest)),
      truth_(truth),
      sinks_(sinks),
      faults_(std::move(dataset.faults)),
      network_(network_model(manifest_.network, options),
               options.seed.value_or(manifest_.network.seed), options.burst_s),
      reach_m_(options.reach_m),
      forwards_(options.forwards),
      delays_(options.delays) {
  for (RobotRecording& recording : dataset.robots) {
    recording.config.graph.enabled &= options.graph;
    if (options.profile) recording.config.estimator.profile = *options.profile;
    robots_.emplace_back(std::move(recording), options.sealed);
    if (sinks.on_records) robots_.back().estimator.keep_records();
  }
  for (std::size_t i = 0; i < robots_.size(); ++i) schedule_recording(i);
}

void VirtualSwarm::schedule(double true_s, std::size_t robot, VirtualInput what) {
  queue_.push_back({true_s, next_order_++, robot, std::move(what)});
  std::ranges::push_heap(queue_, Later{});
}

void VirtualSwarm::schedule_at(Timestamp local, std::size_t robot, VirtualInput what,
                               double delay_s) {
  schedule(robots_[robot].recording.robot.clock.true_s(local) + delay_s, robot, std::move(what));
}

void VirtualSwarm::schedule_recording(std::size_t index) {
  RobotRecording& recording = robots_[index].recording;
  const SensorDelays delays = concerns(delays_, recording.robot) ? delays_ : SensorDelays{};
  for (const ImuSample& sample : recording.imu)
    schedule_at(sample.stamp, index, Event(sample), delays.imu_s);
  for (const UwbRange& range : recording.ranges)
    schedule_at(range.stamp, index, Event(range), delays.uwb_s);
  for (std::size_t k = 0; k < recording.cameras.size(); ++k) {
    CameraRecording& camera = recording.cameras[k];
    // A stamp may lie before the exposure, by the shift between both clocks.
    const double shift_s = k < recording.config.cameras.size()
                               ? recording.config.cameras[k].calibration.timeshift_cam_imu
                               : 0.0;
    const double delay_s = delays.camera_s + std::max(0.0, shift_s);
    for (SpotFrame& frame : camera.spots) {
      const Timestamp stamp = frame.stamp;
      schedule_at(stamp, index, Event(std::move(frame)), delay_s);
    }
    // If a camera has both, the spots are the smaller input.
    if (!std::exchange(camera.spots, {}).empty()) continue;
    for (const RecordedPicture& image : camera.images) {
      schedule_at(image.stamp, index, PendingImage{static_cast<std::uint8_t>(k), image}, delay_s);
    }
  }
  if (recording.imu.empty()) return;
  const Timestamp end = recording.imu.back().stamp;
  for (Timestamp t = recording.imu.front().stamp; t <= end; t += kReplayTick) {
    schedule_at(t, index, Event(Tick{t}));
  }
  std::vector<ImuSample>().swap(recording.imu);  // what is scheduled is not kept twice
  std::vector<UwbRange>().swap(recording.ranges);
}

void VirtualSwarm::append(SwarmDataset later, double from_s) {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    RobotRecording& recording = robots_[i].recording;
    const auto more = std::ranges::find_if(
        later.robots, [&](const RobotRecording& r) { return r.robot.id == robots_[i].id(); });
    if (more == later.robots.end()) continue;
    const Duration by = recording.robot.clock.local(from_s) - recording.robot.clock.local(0.0);
    const auto shift = [by](auto& readings) {
      for (auto& reading : readings) reading.stamp += by;
    };
    shift(more->imu);
    shift(more->ranges);
    for (CameraRecording& camera : more->cameras) {
      shift(camera.spots);
      shift(camera.images);
    }
    recording.imu = std::move(more->imu);
    recording.ranges = std::move(more->ranges);
    recording.cameras = std::move(more->cameras);
    schedule_recording(i);
  }
}

Result<void> VirtualSwarm::run_until(double true_s) {
  while (!queue_.empty() && queue_.front().true_s < true_s)
    if (auto done = deliver_next(); !done) return done;
  return {};
}

Result<void> VirtualSwarm::run(const std::function<void(double)>& on_progress) {
  double reported = 0.0;
  while (!queue_.empty()) {
    const double share = queue_.front().true_s / manifest_.duration_s;
    if (auto done = deliver_next(); !done) return done;
    if (on_progress && share >= reported + 0.01) on_progress(reported = std::min(share, 1.0));
  }
  return {};
}

VirtualRobot& VirtualSwarm::robot(RobotId id) {
  return *std::ranges::find_if(robots_, [id](const auto& robot) { return robot.id() == id; });
}

void VirtualSwarm::switch_on(RobotId id) {
  robot(id).restart();
  robot(id).state = VirtualRobot::State::kOn;
}

Result<void> VirtualSwarm::thaw(RobotId id, double true_s) {
  now_s_ = true_s;
  VirtualRobot& thawed = robot(id);
  thawed.state = VirtualRobot::State::kOn;
  const auto index = static_cast<std::size_t>(
      std::ranges::find_if(robots_, [id](const auto& r) { return r.id() == id; }) -
      robots_.begin());
  for (VirtualInput& input : std::exchange(thawed.held, {})) {
    Arrival arrival{true_s, next_order_++, index, std::move(input)};
    if (auto done = deliver(arrival); !done) return done;
  }
  return {};
}

void VirtualSwarm::send(double arrives_s, RobotId to, VirtualDatagram datagram) {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    if (robots_[i].id() == to) return schedule(arrives_s, i, std::move(datagram));
  }
}

Result<void> VirtualSwarm::deliver_next() {
  std::ranges::pop_heap(queue_, Later{});
  Arrival arrival = std::move(queue_.back());
  queue_.pop_back();
  if (queue_.size() < queue_.capacity() / 4) queue_.shrink_to_fit();
  now_s_ = arrival.true_s;
  VirtualRobot& robot = robots_[arrival.robot];
  if (robot.state == VirtualRobot::State::kOn) return deliver(arrival);
  if (robot.state == VirtualRobot::State::kFrozen && !is_tick(arrival.what)) {
    robot.held.push_back(std::move(arrival.what));
    if (robot.held.size() > kMaxHeld) robot.held.pop_front();
  }
  return {};
}

Result<void> VirtualSwarm::deliver(Arrival& arrival) {
  VirtualRobot& robot = robots_[arrival.robot];
  if (auto* const event = std::get_if<Event>(&arrival.what)) {
    if (prepare(robot, arrival.true_s, *event)) step(arrival, *event);
  } else if (const auto* const datagram = std::get_if<VirtualDatagram>(&arrival.what)) {
    receive(arrival, *datagram);
  } else if (std::holds_alternative<Forward>(arrival.what)) {
    for (const auto& bytes : robot.link.forwards(robot.local(arrival.true_s)))
      broadcast(arrival, bytes);
  } else {
    return detect(arrival, std::get<PendingImage>(arrival.what));
  }
  return {};
}

/// A reading as the robot's clock stamps it. False if it does not exist.
bool VirtualSwarm::prepare(VirtualRobot& robot, double true_s, Event& event) const {
  if (is_own_reading(event)) {
    if (sinks_.on_reading && !sinks_.on_reading(robot.id(), true_s, event)) return false;
    robot.handed.samples += std::holds_alternative<ImuSample>(event) ? 1 : 0;
    if (const auto* const range = std::get_if<UwbRange>(&event))
      robot.handed.ranges += is_member(robot, range->neighbor) ? 1 : 0;
  } else if (!std::holds_alternative<Tick>(event)) {
    return true;  // a solution, on the shifted clock already
  }
  std::visit(ShiftStamp{robot.clock_shift}, event);
  return true;
}

void VirtualSwarm::receive(const Arrival& arrival, const VirtualDatagram& datagram) {
  VirtualRobot& robot = robots_[arrival.robot];
  std::optional<ReceivedReport> received;
  {
    const CpuTimer timer(robot.cpu.net_s);
    received =
        robot.link.receive(datagram.bytes, robot.local(arrival.true_s), robot.seal, datagram.from);
  }
  ++robot.handed.datagrams;
  if (const auto next = robot.link.next_forward())
    schedule_at(*next - robot.clock_shift + std::chrono::microseconds{1}, arrival.robot, Forward{});
  if (!received) return;
  ++robot.handed.reports;
  step(arrival, Event(std::move(*received)));
}

Result<void> VirtualSwarm::detect(const Arrival& arrival, const PendingImage& due) {
  VirtualRobot& robot = robots_[arrival.robot];
  const auto image =
      read_gray_image(due.image.file, robot.recording.config.cameras[due.camera].calibration);
  if (!image) return tl::unexpected(image.error());
  SpotFrame frame{.stamp = due.image.stamp, .camera = due.camera, .spots = {}};
  {
    const CpuTimer timer(robot.cpu.vision_s);
    const Detection found = robot.detector.detect({.pixels = image->pixels.data(),
                                                   .width = image->width,
                                                   .height = image->height,
                                                   .stride = image->width});
    frame.spots.assign(found.spots.begin(), found.spots.end());
  }
  step(arrival, Event(std::move(frame)));
  return {};
}

void VirtualSwarm::step(const Arrival& arrival, const Event& event) {
  VirtualRobot& robot = robots_[arrival.robot];
  Outputs outputs;
  {
    const bool is_vision = std::holds_alternative<SpotFrame>(event);
    const CpuTimer timer(is_vision ? robot.cpu.vision_s : robot.cpu.estimator_s);
    outputs = robot.estimator.step(event);
  }
  handle_outputs(arrival, outputs);
}

void VirtualSwarm::handle_outputs(const Arrival& arrival, const Outputs& outputs) {
  VirtualRobot& robot = robots_[arrival.robot];
  robot.handed.bearings += static_cast<std::uint64_t>(
      std::ranges::count(outputs.bearings, Naming::kRead, &Bearing::how));
  for (const NeighborPose& pose : outputs.poses) sinks_.on_pose(robot.id(), pose);
  if (sinks_.on_records) sinks_.on_records(robot.id(), outputs.records);
  if (outputs.report) {
    Report report = *outputs.report;
    if (sinks_.on_report) sinks_.on_report(report);
    broadcast(arrival, report);
  }
  if (outputs.team_problem) {
    const CpuTimer timer(robot.cpu.graph_s);
    Event solution = robot.team.solve(*outputs.team_problem, robot.recording.config.graph);
    schedule(arrival.true_s + kGraphLatency, arrival.robot, std::move(solution));
  }
  count_id_mistakes(robot, outputs.bearings);
  sample_clocks(robot, arrival.true_s);
}

void VirtualSwarm::broadcast(const Arrival& arrival, const Report& report) {
  VirtualRobot& robot = robots_[arrival.robot];
  const Timestamp now = robot.local(arrival.true_s);
  if (!robot.link.is_due(now)) return;
  std::vector<std::uint8_t> datagram;
  {
    const CpuTimer timer(robot.cpu.net_s);
    datagram = robot.link.compose(report, now, robot.seal, robot.signer);
  }
  broadcast(arrival, datagram);
}

void VirtualSwarm::broadcast(const Arrival& arrival, const std::vector<std::uint8_t>& datagram) {
  VirtualRobot& robot = robots_[arrival.robot];
  ++robot.datagrams_sent;
  robot.bytes_sent += datagram.size();
  std::vector<RobotId> all;
  for (const VirtualRobot& each : robots_) all.push_back(each.id());
  const auto delays_s =
      network_.delays_s(robot.id(), all, arrival.true_s, forwards_,
                        [&](RobotId a, RobotId b) { return are_in_reach(a, b, arrival.true_s); });
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    if (i == arrival.robot) continue;
    std::vector<Delivery> deliveries;
    if (const auto delay_s = delays_s.find(robots_[i].id()); delay_s != delays_s.end()) {
      deliveries.push_back(
          {arrival.true_s + delay_s->second, datagram, replay_address(robot.id())});
    }
    if (sinks_.on_delivery)
      sinks_.on_delivery(robot.id(), robots_[i].id(), arrival.true_s, deliveries);
    for (Delivery& delivery : deliveries) {
      schedule(std::max(arrival.true_s, delivery.arrives_s), i,
               VirtualDatagram{std::move(delivery.bytes), delivery.from});
    }
  }
}

bool VirtualSwarm::are_in_reach(RobotId a, RobotId b, double true_s) const {
  if (reach_m_ <= 0 || !truth_) return true;
  const auto T_W_A = truth_->pose(a, true_s);
  const auto T_W_B = truth_->pose(b, true_s);
  return T_W_A && T_W_B && (T_W_A->p - T_W_B->p).norm() < reach_m_;
}

void VirtualSwarm::count_id_mistakes(VirtualRobot& robot, const std::vector<Bearing>& bearings) {
  if (!truth_) return;
  const auto& members = robot.recording.config.swarm.members;
  for (const Bearing& bearing : bearings) {
    const auto T_B_N = truth_->relative(robot.id(), bearing.neighbor, bearing.stamp);
    const auto member = std::find_if(members.begin(), members.end(), [&](const MemberConfig& m) {
      return m.id == bearing.neighbor;
    });
    if (!T_B_N || member == members.end()) continue;
    if (bearing_error_rad(bearing, *T_B_N, member->p_body_led) > kMaxIdError) {
      ++robot.id_mistakes[bearing.neighbor];
    }
  }
}

void VirtualSwarm::sample_clocks(VirtualRobot& robot, double true_s) {
  if (true_s < robot.next_clock_sample_s) return;
  robot.next_clock_sample_s += kClockSamplePeriod;
  const Timestamp stamp = robot.local(true_s);
  for (const ClockStatus& clock : robot.link.clocks()) {
    clocks_.push_back({robot.id(), stamp, clock});
  }
}

ReplayReport VirtualSwarm::report(const ReplayOptions& options) const {
  ReplayReport report;
  report.scenario = manifest_.scenario;
  report.graph = options.graph;
  report.seed = options.seed.value_or(manifest_.network.seed);
  report.duration_s = manifest_.duration_s;
  report.clocks = clocks_;
  report.faults = faults_;
  for (const VirtualRobot& robot : robots_) {
    const bool paper = robot.recording.config.estimator.profile == Profile::kPaper;
    report.profile = paper ? "paper" : "tight";
    RobotReport one;
    one.robot = robot.id();
    one.status = robot.estimator.status();
    if (truth_) one.id_mistakes = robot.id_mistakes;
    one.datagrams_sent = robot.datagrams_sent;
    one.bytes_sent = robot.bytes_sent;
    one.airtime = robot.airtime(manifest_.duration_s);
    one.network = robot.link.counters().totals();
    one.cpu_s = {{"vision", robot.cpu.vision_s},
                 {"estimator", robot.cpu.estimator_s},
                 {"graph", robot.cpu.graph_s},
                 {"net", robot.cpu.net_s}};
    report.robots.push_back(std::move(one));
  }
  return report;
}

}  // namespace crepes
