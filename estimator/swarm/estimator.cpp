#include "estimator/swarm/estimator.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>
#include <variant>

#include "estimator/core/contract.hpp"
#include "estimator/relative/tilt_filter.hpp"
#include "estimator/swarm/filter_settings.hpp"
#include "estimator/swarm/graph_problem_builder.hpp"
#include "estimator/swarm/imu_mounting.hpp"
#include "estimator/swarm/neighbor.hpp"
#include "estimator/swarm/report_composer.hpp"
#include "estimator/swarm/robot_state.hpp"
#include "estimator/swarm/swapped_modules.hpp"
#include "estimator/swarm/team_intake.hpp"
#include "estimator/swarm/team_log.hpp"
#include "estimator/vision/blink_tracker.hpp"

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

/// The same robots without their names, which no filter uses.
SwarmConfig unnamed(SwarmConfig swarm) {
  for (MemberConfig& member : swarm.members) member.name.clear();
  return swarm;
}

/// What the tracks of lights depend on.
SwarmConfig as_seen(SwarmConfig swarm) {
  for (MemberConfig& member : swarm.members) {
    member.name.clear();
    member.uwb_id.reset();
    member.range_delay_m = 0.0;
    member.p_body_led = member.p_body_uwb = Eigen::Vector3d::Zero();
  }
  return swarm;
}

/// Whether LEDs, antenna or module of a robot that is a member of both are others.
bool is_mounted_otherwise(const SwarmConfig& before, const SwarmConfig& now) {
  const auto mounting = [](const MemberConfig& member) {
    return std::tuple(member.p_body_led, member.p_body_uwb, member.range_delay_m, member.uwb_id);
  };
  return std::ranges::any_of(before.members, [&](const MemberConfig& was) {
    const auto is = std::ranges::find(now.members, was.id, &MemberConfig::id);
    return is != now.members.end() && mounting(*is) != mounting(was);
  });
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

std::vector<BlinkTracker> make_trackers(const EstimatorSettings& settings) {
  const auto library = IdLibrary::from(settings.swarm);
  CREPES_EXPECT(library.has_value(), "validated: every member has a code of its own");
  std::vector<BlinkTracker> trackers;
  for (const CameraCalibration& camera : settings.cameras) {
    const auto model = CameraModel::from(camera);
    CREPES_EXPECT(model.has_value(), "validated: every camera has a calibration");
    trackers.emplace_back(camera, *model, settings.vision, *library, settings.self);
  }
  return trackers;
}

std::vector<bool> are_calibrated(const EstimatorSettings& settings) {
  std::vector<bool> all;
  for (const CameraCalibration& camera : settings.cameras) all.push_back(camera.calibrated);
  return all;
}

/// What the antenna delays of both modules add to a range.
double delay_between(const SwarmConfig& swarm, RobotId a, RobotId b) {
  return member_of(swarm, a).range_delay_m + member_of(swarm, b).range_delay_m;
}

}  // namespace

struct Estimator::State {
  explicit State(const EstimatorSettings& settings)
      : id(settings.self),
        tilt_filter(settings.imu),
        trackers(make_trackers(settings)),
        is_calibrated(are_calibrated(settings)),
        composer(settings.self),
        graph_enabled(settings.solves_graph),
        uses_team_filter(settings.uses_team_filter),
        team_size(settings.team_size),
        report_timer(period_of(settings.report_rate_hz)),
        graph_timer(period_of(settings.graph_rate_hz)),
        swarm(settings.swarm),
        filters(filter_settings(settings.filters, settings.imu, settings.range)),
        vision(settings.vision) {
    add_new_members();
  }

  void reconfigure(const EstimatorSettings& settings);
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
    return graph_enabled && uses_team_filter && filters.traits.has_team_filter;
  }
  /// Null without samples.
  [[nodiscard]] const ImuHistory* imu_of(RobotId robot) const;
  [[nodiscard]] GraphProblem graph_problem(const std::vector<NeighborEstimate>& own) const;
  [[nodiscard]] std::optional<TeamInterval> team_interval(Timestamp now);
  [[nodiscard]] Bearing with_stamp_error(Bearing bearing) const;
  [[nodiscard]] ExpectedBoard expected_board(const NeighborPose& pose) const;
  [[nodiscard]] std::vector<TeamFault> mounting_faults_of(RobotId robot) const;
  [[nodiscard]] std::vector<TeamFault> faults_of(RobotId robot) const;
  void refuse_wrong_mountings();
  void refuse_imu(RobotId robot);
  void end_team();

  RobotId id;
  RobotState self;
  TiltFilter tilt_filter;
  std::vector<BlinkTracker> trackers;
  std::vector<bool> is_calibrated;  ///< one for each tracker
  std::map<RobotId, Neighbor> neighbors;
  std::map<RobotId, PublishedPoses> published;
  GraphProblemBuilder graph_builder;
  TeamIntake team_intake;
  Timestamp last_team = kNever;  ///< an interval of three robots
  ReportComposer composer;
  bool graph_enabled;
  bool uses_team_filter;
  std::size_t team_size;
  PeriodicTimer report_timer;
  PeriodicTimer graph_timer;
  Timestamp last_tick = kNever;
  std::vector<ExpectedBoard> expected;  ///< by the poses of the last tick
  SwarmConfig swarm;
  FilterSettings filters;
  VisionConfig vision;
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
  const MemberConfig& own = member_of(swarm, id);
  for (const MemberConfig& member : swarm.members) {
    if (member.id == id) continue;
    const auto [neighbor, is_new] = neighbors.try_emplace(member.id, own, member, filters);
    if (is_new && keeps_records) neighbor->second.outcomes().keep_records();
  }
}

void Estimator::State::reconfigure(const EstimatorSettings& settings) {
  CREPES_EXPECT(settings.self == id && settings.cameras.size() == trackers.size(),
                "robot and cameras stay the same");
  const SwarmConfig before = unnamed(std::exchange(swarm, settings.swarm));
  const SwarmConfig now = unnamed(swarm);
  const Priors priors = filters.priors;
  filters = filter_settings(settings.filters, settings.imu, settings.range);
  // What the team has learned of a module holds no longer after a calibration.
  if (is_mounted_otherwise(before, now) || !(priors == filters.priors)) team_intake = {};
  const bool own_is_same = member_of(before, id) == member_of(now, id);
  std::erase_if(neighbors, [&](const auto& entry) {
    const RobotId robot = entry.first;
    if (own_is_same && std::ranges::count(now.members, member_of(before, robot)) > 0) return false;
    published[robot].resets_before = published[robot].resets;
    return true;
  });
  for (auto& [robot, neighbor] : neighbors) neighbor.reconfigure(filters);
  add_new_members();

  tilt_filter.set_noise(settings.imu);
  if (!(as_seen(now) == as_seen(before) && settings.vision == vision))
    trackers = make_trackers(settings);
  vision = settings.vision;
  swapped_modules = {};
  graph_enabled = settings.solves_graph;
  uses_team_filter = settings.uses_team_filter;
  team_size = settings.team_size;
  if (!runs_team_filter()) end_team();
  report_timer = PeriodicTimer(period_of(settings.report_rate_hz));
  graph_timer = PeriodicTimer(period_of(settings.graph_rate_hz));
}

Outputs Estimator::State::handle(const ImuSample& sample) {
  for (const ImuSample& believed : self.guard.accept(sample)) {
    if (!tilt_filter.add(believed) || !self.add_believed(believed)) {
      ++refused_samples;
      continue;
    }
    ++used_samples;
    self.tilt = tilt_filter.tilt();
    for (BlinkTracker& tracker : trackers) tracker.add_imu(believed);
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
  corrected.range_m -= delay_between(swarm, id, range.neighbor);
  neighbor->second.add(corrected);
  composer.add(corrected);
  return {};
}

Outputs Estimator::State::handle(const SpotFrame& frame) {
  if (frame.camera >= trackers.size()) {
    ++refused_samples;
    return {};
  }
  Outputs outputs;
  BlinkTracker& tracker = trackers[frame.camera];
  outputs.bearings = tracker.step(frame, expected);
  // A robot that sees its own code sees itself in a mirror.
  std::erase_if(outputs.bearings,
                [&](const Bearing& bearing) { return !neighbors.contains(bearing.neighbor); });
  // IDs are read through any lens; a direction through a guessed one would be degrees off.
  if (!is_calibrated[frame.camera]) return outputs;
  // What was named because a pose expects it there says nothing about the pose until it is read.
  for (const Bearing& bearing : tracker.confirmed()) {
    if (neighbors.contains(bearing.neighbor))
      neighbors.at(bearing.neighbor).add(with_stamp_error(bearing));
  }
  for (Bearing& bearing : outputs.bearings) {
    bearing = with_stamp_error(bearing);
    if (bearing.how != Naming::kRead) continue;
    neighbors.at(bearing.neighbor).add(bearing);
    imu_mounting.add(id, bearing, self.imu);
    composer.add(bearing);
  }
  return outputs;
}

/// A stamp that is off by dt turns the direction by w dt.
Bearing Estimator::State::with_stamp_error(Bearing bearing) const {
  constexpr Duration kNear = std::chrono::milliseconds{10};
  if (self.imu.empty()) return bearing;
  const double w = self.imu.mean(bearing.stamp - kNear, bearing.stamp).gyro_radps.norm();
  bearing.sigma_rad = std::hypot(bearing.sigma_rad, 1e-3 * vision.stamp_sigma_ms * w);
  return bearing;
}

ExpectedBoard Estimator::State::expected_board(const NeighborPose& pose) const {
  const Eigen::Vector3d p_N_M = member_of(swarm, pose.neighbor).p_body_led;
  return {.robot = pose.neighbor,
          .stamp = pose.stamp,
          .p_B_M = pose.T_B_N.pose * p_N_M,
          .v_B_M = pose.v_B_N,
          .covariance_m2 = pose.T_B_N.covariance.topLeftCorner<3, 3>()};
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
  for (const MemberConfig& member : swarm.members)
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
  graph_builder.add_report(received.report, swarm);
  if (!runs_team_filter()) return;
  const ImuHistory& imu = sender.robot_state().imu;
  const double w = imu.empty() ? 0.0 : imu.newest().gyro_radps.norm();
  team_intake.add_report(received.report, w * received.clock_sigma_s, swarm, filters);
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
    for (const MemberConfig& member : swarm.members)
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
  auto interval = team_intake.drain(id, now, swarm, filters, imus);
  if (!interval || interval->members.size() < 2) return std::nullopt;
  if (interval->members.size() > 2) last_team = interval->to;
  if (interval->to - last_team > kTeamMemory) return std::nullopt;
  interval->settings.max_robots = team_size;
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
      expected.push_back(expected_board(*pose));
      if (published[robot].admit(*pose)) outputs.poses.push_back(std::move(*pose));
    }
  }
  if (report_timer.is_due(tick.stamp)) {
    outputs.report = composer.compose(tick.stamp, self, estimates);
  }
  if (outputs.report && runs_team_filter()) {
    graph_builder.add_report(*outputs.report, swarm);
    team_intake.add_own_report(*outputs.report, swarm, filters);
  }
  if (graph_enabled && !self.imu.empty() && graph_timer.is_due(tick.stamp)) {
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
    for (const BlinkTracker& tracker : state_->trackers) {
      const auto decodes = tracker.status().decodes;
      const auto found = decodes.find(robot);
      if (found != decodes.end()) one.id_decodes += found->second;
    }
    one.name = member_of(state_->swarm, robot).name;
    one.faults = state_->faults_of(robot);
    status.neighbors.push_back(std::move(one));
  }
  for (const BlinkTracker& tracker : state_->trackers) {
    const TrackerStatus seen = tracker.status();
    status.predicted_ids.confirmed += seen.predicted_ids.confirmed;
    status.predicted_ids.unconfirmed += seen.predicted_ids.unconfirmed;
    status.foreign_boards += seen.foreign_boards;
  }
  status.tilt = state_->self.tilt;
  status.unknown_senders = state_->unknown_senders;
  status.refused_imu = state_->self.guard.refused();
  status.refused_samples = std::accumulate(status.refused_imu.begin(), status.refused_imu.end(),
                                           state_->refused_samples);
  return status;
}

}  // namespace crepes
