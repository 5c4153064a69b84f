#include "estimator/swarm/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <utility>
#include <variant>

#include "estimator/core/contract.hpp"
#include "estimator/relative/tilt_filter.hpp"
#include "estimator/swarm/camera_tracks.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/graph_problem_builder.hpp"
#include "estimator/swarm/imu_mounting.hpp"
#include "estimator/swarm/neighbor.hpp"
#include "estimator/swarm/report_composer.hpp"
#include "estimator/swarm/robot_state.hpp"
#include "estimator/swarm/settings_change.hpp"
#include "estimator/swarm/swapped_modules.hpp"
#include "estimator/swarm/team_intake.hpp"
#include "estimator/swarm/team_log.hpp"

namespace crepes {
namespace {

const MemberConfig& member_of(const SwarmConfig& swarm, RobotId id) {
  const auto found = std::find_if(swarm.members.begin(), swarm.members.end(),
                                  [id](const MemberConfig& member) { return member.id == id; });
  CREPES_EXPECT(found != swarm.members.end(), "robot.id is one of swarm.members");
  return *found;
}

// True once a period, counted from the first call.
class PeriodicTimer {
 public:
  explicit PeriodicTimer(Duration period) : period_(period) {}

  [[nodiscard]] bool is_due(Timestamp now) {
    if (next_ && now < *next_) return false;
    next_ = !next_ || now - *next_ > period_ ? now + period_ : *next_ + period_;
    return true;
  }

 private:
  Duration period_;
  std::optional<Timestamp> next_;
};

// A graph of two robots has nothing to adjust: both estimates rest on the same readings.
bool connects_three_robots(const GraphProblem& problem) {
  std::set<RobotId> robots;
  for (const RelativePoseEdge& edge : problem.edges) robots.insert({edge.from, edge.to});
  return robots.size() > 2;
}

/// What clients have received of a neighbor, whatever filters it had.
struct PublishedPoses {
  Timestamp newest = kNever;
  std::uint32_t resets = 0;         ///< of all its filters
  std::uint32_t resets_before = 0;  ///< of those before the present one

  /// Counts the resets from the first filter on. False if a pose of this instant was published: the
  /// robot's IMU may be slower than its ticks.
  [[nodiscard]] bool admit(NeighborPose& pose) {
    pose.reset_counter += resets_before;
    resets = pose.reset_counter;
    return pose.stamp > std::exchange(newest, std::max(newest, pose.stamp));
  }
};

Duration period_of(double rate_hz) { return from_seconds(1.0 / rate_hz); }

void append(const Records& more, Records& all) {
  all.measurements.insert(all.measurements.end(), more.measurements.begin(),
                          more.measurements.end());
  all.calibrations.insert(all.calibrations.end(), more.calibrations.begin(),
                          more.calibrations.end());
}

/// What the antenna delays of both modules add to a range.
double delay_between(const SwarmConfig& swarm, RobotId a, RobotId b) {
  return member_of(swarm, a).range_delay_m + member_of(swarm, b).range_delay_m;
}

ExpectedBoard expected_board(const NeighborPose& pose, const Eigen::Vector3d& p_N_M) {
  return {.robot = pose.neighbor,
          .stamp = pose.stamp,
          .p_B_M = pose.T_B_N.pose * p_N_M,
          .v_B_M = pose.v_B_N,
          .covariance_m2 = pose.T_B_N.covariance.topLeftCorner<3, 3>()};
}

}  // namespace

struct Estimator::State {
  explicit State(const EstimatorSettings& initial)
      : id(initial.self),
        settings(initial),
        filters(filter_settings(initial)),
        tilt_filter(initial.imu),
        cameras(initial),
        composer(initial.self),
        report_timer(period_of(initial.report_rate_hz)),
        graph_timer(period_of(initial.graph_rate_hz)) {
    add_new_members();
  }

  void reconfigure(const EstimatorSettings& now);
  void add_new_members();

  Outputs handle(const ImuSample& sample);
  Outputs handle(const UwbRange& range);
  Outputs handle(const SpotFrame& frame);
  Outputs handle(const ReceivedReport& received);
  Outputs handle(const GraphSolution& solution);
  Outputs handle(const TeamSolution& solution);
  Outputs handle(const Tick& tick);

  void accept(const ReceivedReport& received, Neighbor& sender);
  [[nodiscard]] bool runs_team_filter() const {
    return settings.solves_graph && settings.uses_team_filter && filters.traits.has_team_filter;
  }
  /// Null without samples.
  [[nodiscard]] const ImuHistory* imu_of(RobotId robot) const;
  [[nodiscard]] GraphProblem graph_problem(const std::vector<NeighborEstimate>& own) const;
  [[nodiscard]] std::optional<TeamInterval> team_interval(Timestamp now);
  [[nodiscard]] std::vector<TeamFault> mounting_faults_of(RobotId robot) const;
  [[nodiscard]] std::vector<TeamFault> faults_of(RobotId robot) const;
  void refuse_wrong_mountings();
  void refuse_imu(RobotId robot);
  void end_team();

  RobotId id;
  EstimatorSettings settings;
  FilterSettings filters;
  RobotState self;
  TiltFilter tilt_filter;
  CameraTracks cameras;
  std::map<RobotId, Neighbor> neighbors;
  std::map<RobotId, PublishedPoses> published;
  GraphProblemBuilder graph_builder;
  TeamIntake team_intake;
  Timestamp last_team = kNever;  ///< an interval of three robots
  ReportComposer composer;
  PeriodicTimer report_timer;
  PeriodicTimer graph_timer;
  Timestamp last_tick = kNever;
  std::vector<ExpectedBoard> expected;  ///< by the poses of the last tick
  bool keeps_records = false;
  TeamLog team_log;
  SwappedModules swapped_modules;
  ImuMounting imu_mounting;
  std::set<RobotId> wrongly_mounted;  ///< at the last tick
  std::uint64_t unknown_senders = 0;
  std::uint64_t used_samples = 0;
  std::uint64_t refused_samples = 0;
};

/// A Neighbor for every member that has none yet.
void Estimator::State::add_new_members() {
  const MemberConfig& own = member_of(settings.swarm, id);
  for (const MemberConfig& member : settings.swarm.members) {
    if (member.id == id) continue;
    const auto [neighbor, is_new] = neighbors.try_emplace(member.id, own, member, filters);
    if (is_new && keeps_records) neighbor->second.outcomes().keep_records();
  }
}

void Estimator::State::reconfigure(const EstimatorSettings& now) {
  CREPES_EXPECT(now.self == id && now.cameras.size() == cameras.size(),
                "robot and cameras stay the same");
  const SettingsChange change = change_between(settings, now);
  settings = now;
  filters = filter_settings(now);
  if (change.restarts_team) team_intake = {};
  for (const RobotId robot : change.restarts_neighbors) {
    published[robot].resets_before = published[robot].resets;
    neighbors.erase(robot);
  }
  for (auto& [robot, neighbor] : neighbors) neighbor.reconfigure(filters);
  add_new_members();

  tilt_filter.set_noise(now.imu);
  if (change.restarts_tracks) cameras = CameraTracks(now);
  swapped_modules = {};
  if (!runs_team_filter()) end_team();
  report_timer = PeriodicTimer(period_of(now.report_rate_hz));
  graph_timer = PeriodicTimer(period_of(now.graph_rate_hz));
}

Outputs Estimator::State::handle(const ImuSample& sample) {
  for (const ImuSample& believed : self.guard.accept(sample)) {
    for (const KeptRate& rate : self.guard.rates_before(believed)) {
      tilt_filter.add(rate.sample);
      cameras.add_imu(rate.sample);
    }
    if (!tilt_filter.add(believed) || !self.add_believed(believed)) {
      ++refused_samples;
      continue;
    }
    ++used_samples;
    self.tilt = tilt_filter.tilt();
    cameras.add_imu(believed);
  }
  return {};
}

Outputs Estimator::State::handle(const UwbRange& range) {
  if (range.neighbor == id && std::isfinite(range.range_m)) {
    swapped_modules.add(id, range);
    composer.add(range);  // the others must know
  }
  const auto neighbor = neighbors.find(range.neighbor);
  if (neighbor == neighbors.end() || !std::isfinite(range.range_m)) {
    ++refused_samples;
    return {};
  }
  if (swapped_modules.contains(range.neighbor, range.stamp)) {
    neighbor->second.refuse(range, MeasurementKind::kRange);
    return {};
  }
  UwbRange corrected = range;
  corrected.range_m -= delay_between(settings.swarm, id, range.neighbor);
  neighbor->second.add(corrected);
  composer.add(corrected);
  return {};
}

Outputs Estimator::State::handle(const SpotFrame& frame) {
  if (frame.camera >= cameras.size()) {
    ++refused_samples;
    return {};
  }
  SeenBoards seen = cameras.step(frame, expected, self.imu);
  // A robot that sees its own code sees itself in a mirror.
  std::erase_if(seen.bearings,
                [&](const Bearing& bearing) { return !neighbors.contains(bearing.neighbor); });
  // What was named because a pose expects it there says nothing about the pose until it is read.
  for (const Bearing& bearing : seen.confirmed) {
    if (neighbors.contains(bearing.neighbor)) neighbors.at(bearing.neighbor).add(bearing);
  }
  for (const Bearing& bearing : seen.bearings) {
    if (!cameras.is_calibrated(frame.camera) || bearing.how != Naming::kRead) continue;
    neighbors.at(bearing.neighbor).add(bearing);
    imu_mounting.add(id, bearing, self.imu);
    composer.add(bearing);
  }
  Outputs outputs;
  outputs.bearings = std::move(seen.bearings);
  return outputs;
}

/// Those that need no team.
std::vector<TeamFault> Estimator::State::mounting_faults_of(RobotId robot) const {
  std::vector<TeamFault> faults;
  if (const auto module = swapped_modules.fault_of(robot, last_tick)) faults.push_back(*module);
  if (const auto imu = imu_mounting.fault_of(robot)) faults.push_back(*imu);
  return faults;
}

std::vector<TeamFault> Estimator::State::faults_of(RobotId robot) const {
  std::vector<TeamFault> faults = team_log.faults_of(robot);
  std::ranges::copy(mounting_faults_of(robot), std::back_inserter(faults));
  return faults;
}

/// For the next ticks. What the team has learned from a wrong IMU until it was found is wrong too.
void Estimator::State::refuse_wrong_mountings() {
  std::set<RobotId> wrong;
  for (const MemberConfig& member : settings.swarm.members)
    if (imu_mounting.is_wrong(member.id)) wrong.insert(member.id);
  for (const RobotId robot : wrong) refuse_imu(robot);
  if (!std::ranges::includes(wrongly_mounted, wrong)) end_team();
  wrongly_mounted = std::move(wrong);
}

void Estimator::State::refuse_imu(RobotId robot) {
  constexpr Duration kRefusal = std::chrono::milliseconds{300};  // some of the team's solutions
  const Timestamp end = last_tick + kRefusal;
  if (robot == id) {
    self.refused_until = end;
  } else if (const auto neighbor = neighbors.find(robot); neighbor != neighbors.end()) {
    neighbor->second.refuse_imu_until(end);
  }
}

/// It begins anew with the next measurements.
void Estimator::State::end_team() {
  team_intake = {};
  team_log.clear();
  for (auto& [robot, neighbor] : neighbors) neighbor.end_team_pose();
}

Outputs Estimator::State::handle(const ReceivedReport& received) {
  const auto neighbor = neighbors.find(received.report.sender);
  if (neighbor == neighbors.end()) {
    ++unknown_senders;
    return {};
  }
  for (const UwbRange& range : received.report.ranges)
    swapped_modules.add(received.report.sender, range);
  const auto ends_elsewhere = [this](const UwbRange& range) {
    return swapped_modules.contains(range.neighbor, range.stamp);
  };
  if (std::ranges::any_of(received.report.ranges, ends_elsewhere)) {
    for (const UwbRange& range : received.report.ranges) {
      if (range.neighbor == id && ends_elsewhere(range))
        neighbor->second.refuse(range, MeasurementKind::kPeerRange);
    }
    ReceivedReport rest = received;
    std::erase_if(rest.report.ranges, ends_elsewhere);
    accept(rest, neighbor->second);
  } else {
    accept(received, neighbor->second);
  }
  return {};
}

void Estimator::State::accept(const ReceivedReport& received, Neighbor& sender) {
  const RobotId peer = received.report.sender;
  sender.add_report(received, self);
  for (const Bearing& bearing : received.report.bearings) {
    if (bearing.neighbor == id || neighbors.contains(bearing.neighbor))
      imu_mounting.add(peer, bearing, sender.robot_state().imu);
  }
  if (imu_mounting.is_wrong(peer)) return;
  graph_builder.add_report(received.report, settings.swarm);
  if (!runs_team_filter()) return;
  const ImuHistory& imu = sender.robot_state().imu;
  const double w = imu.empty() ? 0.0 : imu.newest().gyro_radps.norm();
  team_intake.add_report(received.report, w * received.clock_sigma_s, settings.swarm, filters);
}

Outputs Estimator::State::handle(const GraphSolution& solution) {
  for (const GraphPose& pose : solution.poses) {
    const auto neighbor = neighbors.find(pose.neighbor);
    if (neighbor != neighbors.end()) neighbor->second.add(StampedGraphPose{solution.stamp, pose});
  }
  return {};
}

Outputs Estimator::State::handle(const TeamSolution& solution) {
  if (!runs_team_filter()) return {};  // it was asked for before a reload
  team_log.add(solution);
  for (const TeamFault& fault : solution.faults) {
    if (fault.kind != TeamFault::Kind::kGyro) continue;
    // Without a tilt this robot reports nothing either, until its gyroscope is right again.
    if (fault.robot == id) tilt_filter.restart();
    refuse_imu(fault.robot);
  }
  const auto bias_of = [&](RobotId robot) {
    const auto found = std::ranges::find(solution.calibrations, robot, &RobotCalibration::robot);
    return found == solution.calibrations.end() ? ImuBiasEstimate{} : found->imu;
  };
  for (auto& [robot, neighbor] : neighbors) {
    if (std::ranges::find(solution.poses, robot, &TeamPose::neighbor) == solution.poses.end())
      neighbor.end_team_pose();
  }
  for (const TeamPose& pose : solution.poses) {
    const auto neighbor = neighbors.find(pose.neighbor);
    if (neighbor != neighbors.end())
      neighbor->second.add(TeamEstimate{solution.stamp, pose, bias_of(id), bias_of(pose.neighbor)});
  }
  Outputs outputs;
  if (keeps_records) {
    TeamRecord record{solution.stamp, solution.residuals, solution.calibrations, solution.faults};
    for (const MemberConfig& member : settings.swarm.members)
      std::ranges::copy(mounting_faults_of(member.id), std::back_inserter(record.faults));
    outputs.records.team.push_back(std::move(record));
  }
  return outputs;
}

const ImuHistory* Estimator::State::imu_of(RobotId robot) const {
  const auto neighbor = neighbors.find(robot);
  const ImuHistory* imu = robot == id                   ? &self.imu
                          : neighbor != neighbors.end() ? &neighbor->second.robot_state().imu
                                                        : nullptr;
  return imu == nullptr || imu->empty() ? nullptr : imu;
}

GraphProblem Estimator::State::graph_problem(const std::vector<NeighborEstimate>& own) const {
  const Timestamp stamp = own.empty() ? self.imu.newest().stamp : own.front().stamp;
  return graph_builder.build(stamp, id, own, [this](RobotId robot) { return imu_of(robot); });
}

/// What was measured until a lag before `now`. Empty for a team of two, which has nothing to share,
/// unless a third robot was there of late: it may come back, and what was learned be needed.
std::optional<TeamInterval> Estimator::State::team_interval(Timestamp now) {
  constexpr Duration kTeamMemory = std::chrono::seconds{5};
  const auto imus = [this](RobotId robot) { return imu_of(robot); };
  if (imu_mounting.is_wrong(id)) return std::nullopt;
  auto interval = team_intake.drain(id, now, settings.swarm, filters, imus);
  if (!interval || interval->members.size() < 2) return std::nullopt;
  if (interval->members.size() > 2) last_team = interval->to;
  if (interval->to - last_team > kTeamMemory) return std::nullopt;
  interval->settings.max_robots = settings.team_size;
  interval->edges = graph_builder.build(interval->to, id, {}, imus).edges;
  return interval;
}

Outputs Estimator::State::handle(const Tick& tick) {
  if (tick.stamp <= last_tick) {
    ++refused_samples;
    return {};
  }
  last_tick = tick.stamp;
  team_log.expire(tick.stamp);
  refuse_wrong_mountings();

  Outputs outputs;
  std::vector<NeighborEstimate> estimates;
  expected.clear();
  for (auto& [robot, neighbor] : neighbors) {
    neighbor.tick(tick.stamp, self);
    append(neighbor.outcomes().drain_records(), outputs.records);
    if (auto estimate = neighbor.output().estimate()) estimates.push_back(*estimate);
    if (auto pose = neighbor.output().published()) {
      if (const auto tilt = self.tilt_at(pose->stamp)) pose->up_B = tilt->up_B;
      expected.push_back(expected_board(*pose, member_of(settings.swarm, robot).p_body_led));
      if (published[robot].admit(*pose)) outputs.poses.push_back(std::move(*pose));
    }
  }
  if (report_timer.is_due(tick.stamp)) {
    outputs.report = composer.compose(tick.stamp, self, estimates);
  }
  if (outputs.report && runs_team_filter()) {
    graph_builder.add_report(*outputs.report, settings.swarm);
    team_intake.add_own_report(*outputs.report, settings.swarm, filters);
  }
  if (settings.solves_graph && !self.imu.empty() && graph_timer.is_due(tick.stamp)) {
    if (runs_team_filter()) {
      if (auto interval = team_interval(tick.stamp)) outputs.team_problem = std::move(*interval);
    } else if (GraphProblem problem = graph_problem(estimates); connects_three_robots(problem)) {
      outputs.team_problem = std::move(problem);
    }
  }
  return outputs;
}

Estimator::Estimator(const EstimatorSettings& settings)
    : state_(std::make_unique<State>(settings)) {}
Estimator::Estimator(Estimator&&) noexcept = default;
Estimator& Estimator::operator=(Estimator&&) noexcept = default;
Estimator::~Estimator() = default;

Outputs Estimator::step(const Event& event) {
  return std::visit([this](const auto& e) { return state_->handle(e); }, event);
}

void Estimator::reconfigure(const EstimatorSettings& settings) { state_->reconfigure(settings); }

void Estimator::keep_records() {
  state_->keeps_records = true;
  for (auto& [robot, neighbor] : state_->neighbors) neighbor.outcomes().keep_records();
}

std::uint64_t Estimator::used_samples() const { return state_->used_samples; }

EstimatorStatus Estimator::status() const {
  EstimatorStatus status;
  status.faults = state_->faults_of(state_->id);
  status.team = state_->team_log.status();
  if (status.team) {
    for (TeamRobotStatus& robot : status.team->robots)
      robot.faults = state_->faults_of(robot.calibration.robot);
  }
  for (const auto& [robot, neighbor] : state_->neighbors) {
    NeighborStatus one = neighbor.status();
    one.name = member_of(state_->settings.swarm, robot).name;
    one.faults = state_->faults_of(robot);
    status.neighbors.push_back(std::move(one));
  }
  state_->cameras.write_to(status);
  status.tilt = state_->self.tilt;
  status.unknown_senders = state_->unknown_senders;
  status.refused_imu = state_->self.guard.refused();
  status.refused_samples = std::accumulate(status.refused_imu.begin(), status.refused_imu.end(),
                                           state_->refused_samples);
  return status;
}

}  // namespace crepes
