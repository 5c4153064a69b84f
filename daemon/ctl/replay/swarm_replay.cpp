#include "daemon/ctl/replay/swarm_replay.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <deque>
#include <map>
#include <queue>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "config/schema/estimator_slice.hpp"
#include "config/schema/mesh_slice.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/dataset/truth.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/ctl/replay/simulated_network.hpp"
#include "drivers/camera/image_folder.hpp"
#include "estimator/swarm/estimator.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "net/mesh/peer_link.hpp"

namespace crepes {
namespace {

// The time that a graph solution takes on a robot; the paper needs 3 ms.
constexpr double kGraphLatency = 0.005;  // s
constexpr double kMaxIdError = 0.05;  // rad; a bearing with a larger error belongs to another robot
constexpr double kClockSamplePeriod = 1.0;  // s

struct Datagram {
  std::vector<std::uint8_t> bytes;
  Endpoint from;
};
// Only the name of an image; it is decoded when it is due.
struct PendingImage {
  std::uint8_t camera = 0;
  RecordedImage image;
};
struct Forward {};  ///< what waits for it
struct Restart {};
using Input = std::variant<Event, Datagram, PendingImage, Forward, Restart>;

/// An input that reaches a robot at an instant of true time.
struct Arrival {
  double true_s = 0.0;
  std::uint64_t order = 0;  ///< breaks ties in the order of scheduling
  std::size_t robot = 0;
  Input what;
};

struct Later {
  bool operator()(const Arrival& a, const Arrival& b) const {
    return std::pair(a.true_s, a.order) > std::pair(b.true_s, b.order);
  }
};

class CpuTimer {
 public:
  explicit CpuTimer(double& total_s) : total_s_(total_s), start_s_(now()) {}
  CpuTimer(const CpuTimer&) = delete;
  CpuTimer& operator=(const CpuTimer&) = delete;
  CpuTimer(CpuTimer&&) = delete;
  CpuTimer& operator=(CpuTimer&&) = delete;
  ~CpuTimer() { total_s_ += now() - start_s_; }

 private:
  static double now() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

  double& total_s_;
  double start_s_;
};

struct StageTimes {
  double vision_s = 0.0;
  double estimator_s = 0.0;
  double graph_s = 0.0;
  double net_s = 0.0;
};

std::vector<RobotId> member_ids(const Config& config) {
  std::vector<RobotId> ids;
  for (const MemberConfig& member : config.swarm.members) ids.push_back(member.id);
  return ids;
}

/// The state that the daemon's threads own, for one robot.
struct Robot {
  Robot(RobotRecording recorded, bool sealed)
      : recording(std::move(recorded)),
        estimator(estimator_settings(recording.config)),
        link(new_link()),
        detector(recording.config.vision),
        period(from_seconds(1.0 / recording.config.estimator.output_rate_hz)) {
    if (!sealed) return;
    seal.emplace(replay_swarm_key());
    signer.emplace(replay_robot_key(recording.robot.id));
    for (const RobotId id : member_ids(recording.config))
      trust.keys.emplace(id, public_key_of(replay_robot_key(id)));
    link.set_trust(trust);
  }

  [[nodiscard]] PeerLink new_link() const {
    PeerLink fresh(recording.robot.id, member_ids(recording.config),
                   send_settings(recording.config));
    fresh.set_trust(trust);
    return fresh;
  }

  void restart() {
    estimator = Estimator(estimator_settings(recording.config));
    team = TeamSolver();
    link = new_link();
  }

  RobotRecording recording;
  Estimator estimator;
  TeamSolver team;
  std::optional<PacketSeal> seal;
  std::optional<PacketSigner> signer;
  MeshTrust trust;
  PeerLink link;
  SpotDetector detector;
  Duration period;
  double next_clock_sample_s = 0.0;
  std::map<RobotId, std::uint64_t> id_mistakes;
  std::uint64_t datagrams_sent = 0;
  std::uint64_t bytes_sent = 0;
  StageTimes cpu;

  [[nodiscard]] double airtime(double duration_s) const {
    if (datagrams_sent == 0) return 0.0;
    const auto datagrams = static_cast<double>(datagrams_sent);
    return crepes::airtime(datagrams / duration_s, static_cast<double>(bytes_sent) / datagrams,
                           send_settings(recording.config).broadcasts);
  }
  [[nodiscard]] RobotId id() const { return recording.robot.id; }
  [[nodiscard]] const RobotClock& clock() const { return recording.robot.clock; }
};

NetworkModel network_model(NetworkModel recorded, const ReplayOptions& options) {
  recorded.loss = options.loss.value_or(recorded.loss);
  return recorded;
}

class SwarmReplay {
 public:
  SwarmReplay(SwarmDataset dataset, const std::optional<SwarmTruth>& truth,
              const ReplayOptions& options, const ReplaySinks& sinks)
      : manifest_(std::move(dataset.manifest)),
        truth_(truth),
        sinks_(sinks),
        faults_(std::move(dataset.faults)),
        network_(network_model(manifest_.network, options),
                 options.seed.value_or(manifest_.network.seed), options.burst_s),
        outages_(options.outages),
        reach_m_(options.reach_m),
        forwards_(options.forwards) {
    for (RobotRecording& recording : dataset.robots) {
      recording.config.graph.enabled &= options.graph;
      if (options.profile) recording.config.estimator.profile = *options.profile;
      robots_.emplace_back(std::move(recording), options.sealed);
      if (sinks.on_records) robots_.back().estimator.keep_records();
    }
    for (std::size_t i = 0; i < robots_.size(); ++i) schedule_recording(i);
    for (const Outage& outage : outages_) {
      for (std::size_t i = 0; i < robots_.size(); ++i)
        if (outage.restarts && robots_[i].id() == outage.robot) schedule(outage.to_s, i, Restart{});
    }
  }

  [[nodiscard]] Result<void> run(const std::function<void(double)>& on_progress);
  [[nodiscard]] ReplayReport report(const ReplayOptions& options) const;

 private:
  void schedule(double true_s, std::size_t robot, Input what) {
    queue_.push({true_s, next_order_++, robot, std::move(what)});
  }
  void schedule_at(Timestamp local, std::size_t robot, Input what) {
    schedule(robots_[robot].clock().true_s(local), robot, std::move(what));
  }
  void schedule_recording(std::size_t index);
  [[nodiscard]] Result<void> deliver(const Arrival& arrival);
  [[nodiscard]] bool is_held(const Arrival& arrival);
  void step(const Arrival& arrival, const Event& event);
  void handle_outputs(const Arrival& arrival, const Outputs& outputs);
  void broadcast(const Arrival& arrival, const Report& report);
  void send(const Arrival& arrival, const std::vector<std::uint8_t>& datagram);
  [[nodiscard]] bool are_in_reach(RobotId a, RobotId b, double true_s) const;
  void count_id_mistakes(Robot& robot, const std::vector<Bearing>& bearings);
  void sample_clocks(Robot& robot, double true_s);

  SwarmManifest manifest_;
  const std::optional<SwarmTruth>& truth_;
  const ReplaySinks& sinks_;
  DatasetFaults faults_;
  SimulatedNetwork network_;
  std::vector<Outage> outages_;
  double reach_m_;
  bool forwards_;
  std::deque<Robot> robots_;
  std::priority_queue<Arrival, std::vector<Arrival>, Later> queue_;
  std::uint64_t next_order_ = 0;
  std::vector<ClockSample> clocks_;
};

void SwarmReplay::schedule_recording(std::size_t index) {
  RobotRecording& recording = robots_[index].recording;
  for (const ImuSample& sample : recording.imu) schedule_at(sample.stamp, index, Event(sample));
  for (const UwbRange& range : recording.ranges) schedule_at(range.stamp, index, Event(range));
  for (std::size_t k = 0; k < recording.cameras.size(); ++k) {
    CameraRecording& camera = recording.cameras[k];
    for (SpotFrame& frame : camera.spots) {
      const Timestamp stamp = frame.stamp;
      schedule_at(stamp, index, Event(std::move(frame)));
    }
    if (!camera.spots.empty()) continue;  // if a camera has both, the spots are the smaller input
    for (const RecordedImage& image : camera.images) {
      schedule_at(image.stamp, index, PendingImage{static_cast<std::uint8_t>(k), image});
    }
  }
  if (recording.imu.empty()) return;
  const Duration period = robots_[index].period;
  const Timestamp end = recording.imu.back().stamp;
  for (Timestamp t = recording.imu.front().stamp; t <= end; t += period) {
    schedule_at(t, index, Event(Tick{t}));
  }
}

Result<void> SwarmReplay::run(const std::function<void(double)>& on_progress) {
  double reported = 0.0;
  while (!queue_.empty()) {
    const Arrival arrival = queue_.top();
    queue_.pop();
    if (auto done = deliver(arrival); !done) return done;
    const double share = arrival.true_s / manifest_.duration_s;
    if (on_progress && share >= reported + 0.01) on_progress(reported = std::min(share, 1.0));
  }
  return {};
}

/// Whether the robot stands still. What can wait for it does.
bool SwarmReplay::is_held(const Arrival& arrival) {
  const RobotId robot = robots_[arrival.robot].id();
  const auto outage = std::ranges::find_if(outages_, [&](const Outage& o) {
    return o.robot == robot && arrival.true_s >= o.from_s && arrival.true_s < o.to_s;
  });
  if (outage == outages_.end()) return false;
  const auto* const event = std::get_if<Event>(&arrival.what);
  const bool is_tick = event != nullptr && std::holds_alternative<Tick>(*event);
  if (!outage->restarts && !is_tick) schedule(outage->to_s, arrival.robot, arrival.what);
  return true;
}

Result<void> SwarmReplay::deliver(const Arrival& arrival) {
  if (is_held(arrival)) return {};
  Robot& robot = robots_[arrival.robot];
  if (std::holds_alternative<Restart>(arrival.what)) {
    robot.restart();
    return {};
  }
  if (std::holds_alternative<Forward>(arrival.what)) {
    for (const auto& datagram : robot.link.forwards(robot.clock().local(arrival.true_s)))
      send(arrival, datagram);
    return {};
  }
  if (const auto* event = std::get_if<Event>(&arrival.what)) {
    step(arrival, *event);
  } else if (const auto* datagram = std::get_if<Datagram>(&arrival.what)) {
    std::optional<ReceivedReport> received;
    {
      const CpuTimer timer(robot.cpu.net_s);
      received = robot.link.receive(datagram->bytes, robot.clock().local(arrival.true_s),
                                    robot.seal, datagram->from);
    }
    if (const auto next = robot.link.next_forward())
      schedule_at(*next + std::chrono::microseconds{1}, arrival.robot, Forward{});
    if (received) step(arrival, Event(std::move(*received)));
  } else {
    const auto& due = std::get<PendingImage>(arrival.what);
    const auto image = read_gray_image(due.image.file);
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
  }
  return {};
}

void SwarmReplay::step(const Arrival& arrival, const Event& event) {
  Robot& robot = robots_[arrival.robot];
  Outputs outputs;
  {
    const bool is_vision = std::holds_alternative<SpotFrame>(event);
    const CpuTimer timer(is_vision ? robot.cpu.vision_s : robot.cpu.estimator_s);
    outputs = robot.estimator.step(event);
  }
  handle_outputs(arrival, outputs);
}

void SwarmReplay::handle_outputs(const Arrival& arrival, const Outputs& outputs) {
  Robot& robot = robots_[arrival.robot];
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

void SwarmReplay::broadcast(const Arrival& arrival, const Report& report) {
  Robot& robot = robots_[arrival.robot];
  const Timestamp now = robot.clock().local(arrival.true_s);
  if (!robot.link.is_due(now)) return;
  std::vector<std::uint8_t> datagram;
  {
    const CpuTimer timer(robot.cpu.net_s);
    datagram = robot.link.compose(report, now, robot.seal, robot.signer);
  }
  send(arrival, datagram);
}

void SwarmReplay::send(const Arrival& arrival, const std::vector<std::uint8_t>& datagram) {
  Robot& robot = robots_[arrival.robot];
  ++robot.datagrams_sent;
  robot.bytes_sent += datagram.size();
  std::vector<RobotId> all;
  for (const Robot& each : robots_) all.push_back(each.id());
  const auto delays_s =
      network_.delays_s(robot.id(), all, arrival.true_s, forwards_,
                        [&](RobotId a, RobotId b) { return are_in_reach(a, b, arrival.true_s); });
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    if (i == arrival.robot) continue;
    std::vector<Delivery> deliveries;
    if (const auto delay_s = delays_s.find(robots_[i].id()); delay_s != delays_s.end())
      deliveries.push_back(
          {arrival.true_s + delay_s->second, datagram, replay_address(robot.id())});
    if (sinks_.on_delivery)
      sinks_.on_delivery(robot.id(), robots_[i].id(), arrival.true_s, deliveries);
    for (Delivery& delivery : deliveries)
      schedule(std::max(arrival.true_s, delivery.arrives_s), i,
               Datagram{std::move(delivery.bytes), delivery.from});
  }
}

bool SwarmReplay::are_in_reach(RobotId a, RobotId b, double true_s) const {
  if (reach_m_ <= 0 || !truth_) return true;
  const auto T_W_A = truth_->pose(a, true_s);
  const auto T_W_B = truth_->pose(b, true_s);
  return T_W_A && T_W_B && (T_W_A->p - T_W_B->p).norm() < reach_m_;
}

void SwarmReplay::count_id_mistakes(Robot& robot, const std::vector<Bearing>& bearings) {
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

void SwarmReplay::sample_clocks(Robot& robot, double true_s) {
  if (true_s < robot.next_clock_sample_s) return;
  robot.next_clock_sample_s += kClockSamplePeriod;
  const Timestamp stamp = robot.clock().local(true_s);
  for (const ClockStatus& clock : robot.link.clocks()) {
    clocks_.push_back({robot.id(), stamp, clock});
  }
}

ReplayReport SwarmReplay::report(const ReplayOptions& options) const {
  ReplayReport report;
  report.scenario = manifest_.scenario;
  report.graph = options.graph;
  report.seed = options.seed.value_or(manifest_.network.seed);
  report.duration_s = manifest_.duration_s;
  report.clocks = clocks_;
  report.faults = faults_;
  for (const Robot& robot : robots_) {
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

}  // namespace

Endpoint replay_address(RobotId robot) {
  constexpr std::uint16_t kPort = 47474;
  const auto high = static_cast<std::uint8_t>(robot.value >> 8U);
  return Endpoint::ipv4({10, 0, high, static_cast<std::uint8_t>(robot.value & 0xFFU)}, kPort);
}

MeshKey replay_swarm_key() { return MeshKey{{7}}; }

RobotKey replay_robot_key(RobotId robot) {
  const std::array<std::uint8_t, 32> seed{static_cast<std::uint8_t>(robot.value & 0xFFU),
                                          static_cast<std::uint8_t>(robot.value >> 8U)};
  return robot_key_of(seed);
}

Result<ReplayReport> replay_dataset(SwarmDataset dataset, const std::optional<SwarmTruth>& truth,
                                    const ReplayOptions& options, const ReplaySinks& sinks) {
  SwarmReplay replay(std::move(dataset), truth, options, sinks);
  if (auto done = replay.run(options.on_progress); !done) return tl::unexpected(done.error());
  return replay.report(options);
}

Result<ReplaySummary> replay_swarm(const ReplayOptions& options) {
  auto dataset = load_swarm(options.swarm_dir);
  if (!dataset) return tl::unexpected(dataset.error());
  ReplayOutput::Names names;
  for (const RobotRecording& robot : dataset->robots) names[robot.robot.id] = robot.robot.name;
  std::optional<SwarmTruth> truth;  // judges IDs for the report; no estimator sees it
  if (std::filesystem::exists(options.swarm_dir / "truth")) {
    auto loaded = SwarmTruth::load(options.swarm_dir, dataset->manifest);
    if (!loaded) return tl::unexpected(loaded.error());
    truth = std::move(*loaded);
  }
  if (options.reach_m > 0 && !truth)
    return fail(ErrorCode::kConfig, "who is in reach of whom is known by truth/, which is missing");
  auto output = ReplayOutput::create(
      options.out_dir, std::move(names),
      options.records ? ReplayOutput::Detail::kRecords : ReplayOutput::Detail::kPoses);
  if (!output) return tl::unexpected(output.error());

  ReplaySummary summary{.robots = dataset->robots.size(),
                        .duration_s = dataset->manifest.duration_s,
                        .faults = dataset->faults};
  ReplaySinks sinks;
  sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
    output->write(observer, pose);
    ++summary.poses;
  };
  if (options.records) {
    sinks.on_records = [&](RobotId observer, const Records& records) {
      output->write(observer, records);
    };
  }
  const auto report = replay_dataset(std::move(*dataset), truth, options, sinks);
  if (!report) return tl::unexpected(report.error());
  if (auto done = output->finish(*report); !done) return tl::unexpected(done.error());
  return summary;
}

}  // namespace crepes
