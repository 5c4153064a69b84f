#include "estimator/swarm/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <variant>

#include "estimator/core/contract.hpp"
#include "estimator/relative/tilt_filter.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/neighbor.hpp"
#include "estimator/swarm/report_composer.hpp"
#include "estimator/swarm/robot_state.hpp"
#include "estimator/swarm/team.hpp"
#include "estimator/vision/blink_tracker.hpp"

namespace crepes {
namespace {

// Estimates travel at this rate: the graph asks for no more.
constexpr Duration kEstimatePeriod = std::chrono::milliseconds{100};

const MemberConfig& member_of(const SwarmConfig& swarm, RobotId id) {
  const auto found = std::find_if(swarm.members.begin(), swarm.members.end(),
                                  [id](const MemberConfig& member) { return member.id == id; });
  CREPES_EXPECT(found != swarm.members.end(), "robot.id is one of swarm.members");
  return *found;
}

// True once a period, counted from the first call.
class Metronome {
 public:
  explicit Metronome(Duration period) : period_(period) {}

  [[nodiscard]] bool is_due(Timestamp now) {
    if (next_ && now < *next_) return false;
    next_ = !next_ || now - *next_ > period_ ? now + period_ : *next_ + period_;
    return true;
  }

 private:
  Duration period_;
  std::optional<Timestamp> next_;
};

// Two robots alone have nothing to adjust: both their estimates rest on the same readings.
bool is_a_team(const GraphProblem& problem) {
  std::set<RobotId> robots;
  for (const RelativePoseEdge& edge : problem.edges) robots.insert({edge.from, edge.to});
  return robots.size() > 2;
}

Duration period_of(double rate_hz) { return from_seconds(1.0 / rate_hz); }

void append(const Records& more, Records& all) {
  all.measurements.insert(all.measurements.end(), more.measurements.begin(),
                          more.measurements.end());
  all.calibrations.insert(all.calibrations.end(), more.calibrations.begin(),
                          more.calibrations.end());
}

std::vector<BlinkTracker> make_trackers(const Config& config) {
  const auto library = IdLibrary::from(config.swarm);
  CREPES_EXPECT(library.has_value(), "validated: every member has a code of its own");
  std::vector<BlinkTracker> trackers;
  for (const CameraConfig& camera : config.cameras) {
    const auto model = CameraModel::from(camera);
    CREPES_EXPECT(model.has_value(), "validated: every camera has a calibration");
    trackers.emplace_back(camera, *model, config.vision, *library, config.robot.id);
  }
  return trackers;
}

}  // namespace

struct Estimator::State {
  explicit State(const Config& config)
      : id(config.robot.id),
        tilt_filter(config.imu),
        trackers(make_trackers(config)),
        composer(config.robot.id),
        graph_enabled(config.graph.enabled),
        report_clock(period_of(config.net.report_rate_hz)),
        estimate_clock(kEstimatePeriod),
        graph_clock(period_of(config.graph.rate_hz)),
        swarm(config.swarm),
        vision(config.vision) {
    meet_members(filter_settings(config.estimator, config.imu, config.uwb));
  }

  void reconfigure(const Config& config);
  void meet_members(const FilterSettings& settings);

  Outputs on(const ImuSample& sample);
  Outputs on(const UwbRange& range);
  Outputs on(const SpotFrame& frame);
  Outputs on(const ReceivedReport& received);
  Outputs on(const GraphSolution& solution);
  Outputs on(const Tick& tick);

  [[nodiscard]] GraphProblem graph_problem(const std::vector<NeighborEstimate>& own) const;

  RobotId id;
  RobotState self;
  TiltFilter tilt_filter;
  std::vector<BlinkTracker> trackers;
  std::map<RobotId, Neighbor> neighbors;
  Team team;
  ReportComposer composer;
  bool graph_enabled;
  Metronome report_clock;
  Metronome estimate_clock;
  Metronome graph_clock;
  Timestamp last_tick = kNever;
  SwarmConfig swarm;
  VisionConfig vision;
  bool keeps_records = false;
  std::uint64_t unknown_senders = 0;
  std::uint64_t refused_samples = 0;
};

/// A Neighbor for every member that has none yet.
void Estimator::State::meet_members(const FilterSettings& settings) {
  const MemberConfig& own = member_of(swarm, id);
  for (const MemberConfig& member : swarm.members) {
    if (member.id == id) continue;
    const auto [neighbor, is_new] = neighbors.try_emplace(member.id, own, member, settings);
    if (is_new && keeps_records) neighbor->second.keep_records();
  }
}

void Estimator::State::reconfigure(const Config& config) {
  CREPES_EXPECT(config.robot.id == id && config.cameras.size() == trackers.size(),
                "robot and cameras stay the same");
  const SwarmConfig before = std::exchange(swarm, config.swarm);
  const FilterSettings settings = filter_settings(config.estimator, config.imu, config.uwb);
  const bool own_is_same = member_of(before, id) == member_of(swarm, id);
  std::erase_if(neighbors, [&](const auto& entry) {
    const auto& now = swarm.members;
    return !own_is_same ||
           std::find(now.begin(), now.end(), member_of(before, entry.first)) == now.end();
  });
  for (auto& [robot, neighbor] : neighbors) neighbor.reconfigure(settings);
  meet_members(settings);

  tilt_filter.set_noise(config.imu);
  if (!(swarm == before && config.vision == vision)) trackers = make_trackers(config);
  vision = config.vision;
  graph_enabled = config.graph.enabled;
  report_clock = Metronome(period_of(config.net.report_rate_hz));
  graph_clock = Metronome(period_of(config.graph.rate_hz));
}

Outputs Estimator::State::on(const ImuSample& sample) {
  if (!self.watch.accept(sample) || !tilt_filter.add(sample) || !self.imu.push(sample)) {
    ++refused_samples;
    return {};
  }
  self.tilt = tilt_filter.tilt();
  for (BlinkTracker& tracker : trackers) tracker.add_imu(sample);
  return {};
}

Outputs Estimator::State::on(const UwbRange& range) {
  const auto neighbor = neighbors.find(range.neighbor);
  if (neighbor == neighbors.end() || !std::isfinite(range.range_m)) {
    ++refused_samples;
    return {};
  }
  neighbor->second.add_range(range);
  composer.add(range);
  return {};
}

Outputs Estimator::State::on(const SpotFrame& frame) {
  if (frame.camera >= trackers.size()) {
    ++refused_samples;
    return {};
  }
  Outputs outputs;
  outputs.bearings = trackers[frame.camera].step(frame);
  // A robot that sees its own blinking sees it in a mirror.
  std::erase_if(outputs.bearings,
                [&](const Bearing& bearing) { return !neighbors.contains(bearing.neighbor); });
  for (const Bearing& bearing : outputs.bearings) {
    neighbors.at(bearing.neighbor).add_bearing(bearing);
    composer.add(bearing);
  }
  return outputs;
}

Outputs Estimator::State::on(const ReceivedReport& received) {
  const auto neighbor = neighbors.find(received.report.sender);
  if (neighbor == neighbors.end()) {
    ++unknown_senders;
    return {};
  }
  neighbor->second.add_report(received, self);
  team.add(received.report);
  return {};
}

Outputs Estimator::State::on(const GraphSolution& solution) {
  for (const GraphPose& pose : solution.poses) {
    const auto neighbor = neighbors.find(pose.neighbor);
    if (neighbor != neighbors.end()) neighbor->second.add_graph_pose(solution.stamp, pose);
  }
  return {};
}

GraphProblem Estimator::State::graph_problem(const std::vector<NeighborEstimate>& own) const {
  const auto imu_of = [this](RobotId robot) -> const ImuHistory* {
    const auto neighbor = neighbors.find(robot);
    const ImuHistory* imu = robot == id                   ? &self.imu
                            : neighbor != neighbors.end() ? &neighbor->second.body().imu
                                                          : nullptr;
    return imu == nullptr || imu->empty() ? nullptr : imu;
  };
  const Timestamp stamp = own.empty() ? self.imu.newest().stamp : own.front().stamp;
  return team.problem(stamp, id, own, imu_of);
}

Outputs Estimator::State::on(const Tick& tick) {
  if (tick.stamp <= last_tick) {
    ++refused_samples;
    return {};
  }
  last_tick = tick.stamp;

  Outputs outputs;
  std::vector<NeighborEstimate> estimates;
  for (auto& [robot, neighbor] : neighbors) {
    neighbor.tick(tick.stamp, self);
    append(neighbor.take_records(), outputs.records);
    if (auto estimate = neighbor.estimate()) estimates.push_back(*estimate);
    if (auto pose = neighbor.improved_pose()) outputs.poses.push_back(std::move(*pose));
  }
  if (report_clock.is_due(tick.stamp)) {
    const bool with_estimates = estimate_clock.is_due(tick.stamp);
    outputs.report = composer.compose(tick.stamp, self,
                                      with_estimates ? estimates : std::vector<NeighborEstimate>{});
  }
  if (graph_enabled && !self.imu.empty() && graph_clock.is_due(tick.stamp)) {
    GraphProblem problem = graph_problem(estimates);
    if (is_a_team(problem)) outputs.graph_problem = std::move(problem);
  }
  return outputs;
}

Estimator::Estimator(const Config& config) : state_(std::make_unique<State>(config)) {}
Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;
Estimator::~Estimator() = default;

Outputs Estimator::step(const Event& event) {
  return std::visit([this](const auto& e) { return state_->on(e); }, event);
}

void Estimator::reconfigure(const Config& config) { state_->reconfigure(config); }

void Estimator::keep_records() {
  state_->keeps_records = true;
  for (auto& [robot, neighbor] : state_->neighbors) neighbor.keep_records();
}

EstimatorStatus Estimator::status() const {
  EstimatorStatus status;
  for (const auto& [robot, neighbor] : state_->neighbors) {
    NeighborStatus one = neighbor.status();
    for (const BlinkTracker& tracker : state_->trackers) {
      const auto decodes = tracker.status().decodes;
      const auto found = decodes.find(robot);
      if (found != decodes.end()) one.id_decodes += found->second;
    }
    status.neighbors.push_back(std::move(one));
  }
  status.tilt = state_->self.tilt;
  status.unknown_senders = state_->unknown_senders;
  status.refused_samples = state_->refused_samples;
  return status;
}

}  // namespace crepes
