#include "estimator/team/team_filter.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/team/belief/place_chains.hpp"
#include "estimator/team/belief/sight_places.hpp"
#include "estimator/team/keyframe_pose.hpp"
#include "estimator/team/readings/reading_rows.hpp"
#include "estimator/team/readings/team_scale.hpp"
#include "estimator/team/readings/team_update.hpp"
#include "estimator/team/trust/team_faults.hpp"

namespace crepes {
namespace {

constexpr double kUnknownDistance = 0.10;  // m; the least by which a step is judged
constexpr double kLinear = 0.01;           // rad, and relative to the distance
constexpr int kMaxIterations = 4;
constexpr double kSignificant = 4.0;    // sigmas of the directions: a parallax
constexpr std::size_t kMaxCameras = 4;  // of a robot, whatever it reports

/// Whether this robot itself has an estimate of the other one, or is estimated by it.
bool has_own_edge(const TeamInterval& interval, RobotId id) {
  return std::ranges::any_of(interval.edges, [&](const RelativePoseEdge& edge) {
    return ordered(edge.from, edge.to) == ordered(interval.self, id);
  });
}

bool is_among(const std::vector<RobotId>& robots, RobotId id) {
  return std::ranges::find(robots, id) != robots.end();
}

/// Of a correction: turns [rad], and moves over the distance.
double largest_step(const std::map<RobotId, TeamRobot>& robots, const Eigen::VectorXd& dx) {
  double largest = 0.0;
  for (const auto& [id, robot] : robots) {
    for (const TeamCamera& camera : robot.cameras)
      largest = std::max(largest, dx.segment<3>(camera.index).norm());
    if (robot.motion_index < 0) continue;
    const double distance = std::max(robot.motion.p_F.norm(), kUnknownDistance);
    largest = std::max({largest, dx.segment<3>(robot.motion_index + 6).norm(),
                        dx.segment<3>(robot.motion_index).norm() / distance});
  }
  return largest;
}

}  // namespace

TeamSolution TeamFilter::step(const TeamInterval& interval) {
  if (interval.member(interval.self) == nullptr || interval.to <= interval.from) {
    belief_.robots.clear();
    memory_.clear();
    return {.stamp = interval.to, .poses = {}, .calibrations = {}, .residuals = {}, .faults = {}};
  }
  residuals_.clear();
  const bool goes_on = interval.self == belief_.self && interval.from == belief_.stamp &&
                       belief_.robots.size() <= interval.settings.max_robots;
  if (belief_.robots.empty() || !goes_on) begin_anew(interval);
  append_cameras(interval);  // before their first interval corrects anything, it is checked
  const bool are_placed = !remove_members(interval);
  if (are_placed) {
    trust_.end_probations(belief_);
    append_cameras(interval);
    belief_.append_range_biases(interval);
    if (correct(interval)) {
      trust_.note_leaps(interval, belief_, residuals_);
    } else {
      begin_anew(interval);
    }
  }
  unseen_.add(interval, belief_);
  belief_.advance(interval);
  memory_.add_vibration(interval);
  if (are_placed) {
    estimates_.add(interval, belief_);
    if (!trust_.is_everybody_strained(belief_.stamp)) memory_.add(belief_);
  }
  TeamSolution solution{.stamp = belief_.stamp,
                        .poses = {},
                        .calibrations = {},
                        .residuals = residuals_,
                        .faults = {}};
  add_members(interval, exchange_member(interval), are_placed, solution);
  report(interval, are_placed, solution);
  return solution;
}

/// False gyroscopes have spoilt all calibrations, and these are recalled. Where something has
/// strained them for perhaps longer than the memory goes back, all start anew: a turned camera of a
/// trusted robot, robots with false ranges, this robot itself. Then nobody is left to be placed.
bool TeamFilter::remove_members(const TeamInterval& interval) {
  const std::vector<RobotId> lost = trust_.note_lost(interval, belief_);
  for (const RobotId id : lost) remove(id);
  const std::vector<RobotId> false_ones = false_gyros(interval);
  if (must_recall_own(interval)) {
    // Nothing corrects this interval even if there is no earlier belief.
    if (!recall(interval, {belief_.self})) begin_anew(interval);
    return true;
  }
  const bool have_spoilt = std::ranges::any_of(
      false_ones, [this](RobotId id) { return belief_.robots.at(id).is_trusted; });
  for (const RobotId id : false_ones) remove(id);
  const bool have_strained = remove_turned(interval) || is_among(lost, belief_.self);
  if (have_strained || trust_.note_misleading(belief_)) {
    begin_anew(interval);
    return false;
  }
  if (!have_spoilt) return false;
  if (recall(interval, false_ones)) return true;
  if (is_among(false_ones, belief_.self)) begin_anew(interval);
  return false;
}

/// At the end of the time in which this robot's own gyroscope was refused: it may have been false
/// for longer than it was found to be.
bool TeamFilter::must_recall_own(const TeamInterval& interval) const {
  return trust_.is_gyro_false(belief_.self, interval.from) &&
         !trust_.is_gyro_false(belief_.self, interval.to) && !are_others_plausible();
}

/// Where the camera was only knocked, its robot stays.
bool TeamFilter::remove_turned(const TeamInterval& interval) {
  bool have_strained = false;
  for (const RobotId id : trust_.note_turned(interval, belief_)) {
    if (const auto camera = trust_.knocked_camera(id)) {
      belief_.realign(id, *camera, trust_.turn_covariance(id).value());
      memory_.clear();
      continue;
    }
    have_strained = have_strained || belief_.robots.at(id).is_trusted;
    remove(id);
  }
  return have_strained;
}

bool TeamFilter::are_others_plausible() const {
  return std::ranges::all_of(belief_.robots, [this](const auto& entry) {
    return entry.first == belief_.self || has_plausible_place(belief_, entry.first);
  });
}

/// This robot itself stays.
void TeamFilter::remove(RobotId id) {
  if (id == belief_.self) return;
  belief_.remove(id);
  memory_.remove(id);
}

bool TeamFilter::recall(const TeamInterval& interval, const std::vector<RobotId>& false_gyros) {
  const std::optional<TeamBelief> earlier = memory_.recall(interval.from);
  if (!earlier) return false;
  const std::map<RobotId, TeamRobot> present = std::move(belief_.robots);
  belief_ = earlier->calibrations_at(interval);
  const bool is_own = is_among(false_gyros, belief_.self);
  if (is_own) belief_.doubt_imu(belief_.self, interval.settings.priors);
  for (auto& [id, robot] : belief_.robots) {
    const auto now = present.find(id);
    // This robot's estimates, which will place the others, are as disturbed as the team's were.
    robot.is_trusted =
        id == belief_.self || (!is_own && now != present.end() && now->second.is_trusted);
    if (id != belief_.self && is_own) robot.since = interval.to;
  }
  return true;
}

void TeamFilter::begin_anew(const TeamInterval& interval) {
  belief_ = TeamBelief::beginning(interval);
  memory_.clear();
}

/// Whose estimates place nobody. Without this robot's own there is no chain.
std::set<RobotId> TeamFilter::liars() const {
  std::set<RobotId> liars;
  for (const TeamFault& fault : estimates_.faults()) liars.insert(fault.robot);
  liars.erase(belief_.self);
  return liars;
}

RobotId TeamFilter::exchange_member(const TeamInterval& interval) {
  links_.add(interval, belief_, liars());
  if (belief_.robots.size() < interval.settings.max_robots) return {};
  const auto exchange = links_.exchange(belief_.stamp, belief_);
  if (!exchange) return {};
  remove(exchange->leaves);
  return exchange->joins;
}

/// All robots in the belief have an IMU over the interval.
std::vector<RobotId> TeamFilter::false_gyros(const TeamInterval& interval) {
  const auto checks = gyro_checks(interval, belief_.trajectories(interval), belief_);
  for (const auto& [id, check] : checks) {
    const bool is_refused = check.contradiction.has_value();
    residuals_.push_back({.observer = id,
                          .neighbor = id,
                          .kind = TeamResidual::Kind::kGyro,
                          .fused = is_refused ? 0 : 1,
                          .refused = is_refused ? 1 : 0,
                          .nis = check.chi2,
                          .dimension = check.dimension});
  }
  return trust_.note_false_gyros(interval, belief_, checks);
}

/// For cameras that measure for the first time.
void TeamFilter::append_cameras(const TeamInterval& interval) {
  const double known = interval.settings.priors.misalignment_rad;
  for (const TeamBearing& reading : interval.bearings) {
    const auto observer = belief_.robots.find(reading.observer);
    if (observer == belief_.robots.end() || !belief_.robots.contains(reading.bearing.neighbor))
      continue;
    auto& cameras = observer->second.cameras;
    const Eigen::Vector3d& p_B_C = reading.bearing.p_B_C;
    if (cameras.size() >= kMaxCameras ||
        std::ranges::find(cameras, p_B_C, &TeamCamera::p_B_C) != cameras.end())
      continue;
    const auto turn = trust_.turn_covariance(reading.observer);
    cameras.push_back({.p_B_C = p_B_C,
                       .index = belief_.append(3, known),
                       .is_free = turn.has_value(),
                       .is_refused = turn && trust_.is_refused(reading.observer)});
    if (turn) belief_.P.bottomRightCorner<3, 3>() = *turn;
    belief_.append(3, interval.settings.priors.lens_rad);
  }
}

bool TeamFilter::correct(const TeamInterval& interval) {
  const double dt_s = to_seconds(interval.to - interval.from);
  for (auto& [id, robot] : belief_.robots) {
    for (TeamCamera& camera : robot.cameras)
      for (auto& [neighbor, agreement] : camera.agreement) agreement.pass(dt_s);
  }
  for (auto& [pair, range] : belief_.ranges)
    for (auto& [observer, agreement] : range.agreement) agreement.pass(dt_s);

  // Bearings come first: ranges may have gone through or around something, so that they are gated
  // by what the bearings leave open.
  for (const Stage stage : {Stage::kTrusted, Stage::kProbation}) {
    const TeamReadings all = TeamReadings::of(interval, belief_, stage);
    if (!correct(interval, stage, {.sights = all.sights, .rangings = {}}) ||
        !correct(interval, stage, {.sights = {}, .rangings = all.rangings}))
      return false;
  }
  const auto variances = belief_.P.diagonal();
  return variances.allFinite() && variances.minCoeff() > 0.0;
}

bool TeamFilter::correct(const TeamInterval& interval, Stage stage, TeamReadings readings) {
  if (readings.empty()) return true;
  const double time_s = readings.time_s(interval);
  const std::vector<bool> corrected = corrected_states(stage);
  std::map<RobotId, TeamRobot> robots;
  std::map<RobotPair, TeamRangeBias> ranges;
  const TeamArcs arcs(belief_, corrected);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(belief_.P.rows());
  Eigen::VectorXd dx = none;
  for (int iteration = 1;; ++iteration) {
    const TeamTrajectories paths = belief_.trajectories(interval);
    const TeamInstant instant(belief_, paths, time_s);
    const ReadingScene scene{interval, paths, instant, belief_, arcs};
    if (iteration == 1) {
      gate(scene, belief_, readings, residuals_);
      robots = belief_.robots;
      ranges = belief_.ranges;
    }
    const Eigen::VectorXd dy = instant.image_of(arcs.carried(dx, none, dx));
    const std::vector<TeamRow> rows = linearized(scene, readings, dy);
    belief_.robots = robots;
    belief_.ranges = ranges;
    if (rows.empty()) {  // the last step may have made all ranges unlikely
      arcs.carry(dx, none, belief_.P);
      return true;
    }
    TeamUpdate update(rows, dy, instant.covariance(), instant.with_belief());
    if (!update.is_valid()) return false;
    if (stage == Stage::kTrusted && !readings.sights.empty()) {
      const TeamScale scale(belief_, corrected);
      update.withhold(scale.by_states, kSignificant * kSignificant * scale.count, belief_.P);
    }
    Eigen::VectorXd next = arcs.carried(update.correction(), dx, none);
    for (Eigen::Index i = 0; i < next.size(); ++i)
      if (!corrected[static_cast<std::size_t>(i)]) next(i) = 0.0;
    const bool is_linear = largest_step(robots, next - dx) < kLinear;
    const bool is_last = is_linear || iteration == kMaxIterations;
    if (is_last) update.correct(corrected, belief_.P);
    arcs.carry(dx, next, belief_.P);
    dx = next;
    belief_.inject(dx + arcs.off_tangent(dx));
    if (is_last) break;
  }
  for (const auto& [id, robot] : belief_.robots) {
    if (robot.motion_index >= 0 && !arcs.contains(robot.motion_index))
      belief_.reset_attitude(robot.motion_index + 6, dx);
  }
  return true;
}

/// Which states the readings of a stage correct: those of trusted robots, or of those on probation.
std::vector<bool> TeamFilter::corrected_states(Stage stage) const {
  std::vector<bool> corrected(static_cast<std::size_t>(belief_.P.rows()), false);
  const auto mark = [&](int index, int count) {
    std::fill_n(corrected.begin() + index, count, true);
  };
  const auto is_corrected = [&](RobotId id) {
    return belief_.robots.at(id).is_trusted == (stage == Stage::kTrusted);
  };
  for (const auto& [id, robot] : belief_.robots) {
    if (!is_corrected(id)) continue;
    if (robot.motion_index >= 0) mark(robot.motion_index, FreeMotionAt::kMotion);
    mark(robot.bias_index, TeamRobot::kCalibration);
    for (const TeamCamera& camera : robot.cameras) mark(camera.index, TeamCamera::kStates);
  }
  for (const auto& [pair, range] : belief_.ranges) {
    const bool is_between_trusted =
        belief_.robots.at(pair.first).is_trusted && belief_.robots.at(pair.second).is_trusted;
    if (is_between_trusted == (stage == Stage::kTrusted)) mark(range.index, 1);
  }
  return corrected;
}

/// Robots that estimates connect to a known one, or that ranges alone locate, the most certain
/// first; a place is kept for `first`, if it is one. When the filter is full, the others are
/// located by their chain of estimates alone. Unless the robots of the belief are placed, they are
/// placed here or removed.
void TeamFilter::add_members(const TeamInterval& interval, RobotId first, bool are_placed,
                             TeamSolution& solution) {
  std::map<RobotId, TeamPlace> candidates = unseen_places(interval, are_placed);
  if (are_placed) candidates.merge(places_by_sight(interval, belief_));
  std::map<RobotId, TeamPlace> known;
  for (const auto& [id, robot] : belief_.robots)
    if (are_placed || id == belief_.self) known[id] = TeamPlace::of(belief_, id);
  std::set<RobotId> unplaced;
  for (const auto& [id, robot] : belief_.robots)
    if (!known.contains(id)) unplaced.insert(id);
  for (const auto& [id, place] : places_by_chains(known, candidates, liars(), interval)) {
    const std::size_t reserved = first != RobotId{} && first != id ? 1 : 0;
    unplaced.erase(id);
    if (belief_.robots.contains(id)) {
      place_member(id, place);
    } else if (belief_.robots.size() + reserved < interval.settings.max_robots) {
      if (first == id) first = {};
      add_member(interval, id, place);
    } else if (!has_own_edge(interval, id)) {
      // A pair's filter would know it better than a chain of estimates.
      solution.poses.push_back(place.pose(id, belief_, interval.settings.priors));
    }
  }
  for (const RobotId id : unplaced) remove(id);
}

/// Of robots to add. Those that are placed already are placed again if ranges show more than what
/// is left of when they were seen.
std::map<RobotId, TeamPlace> TeamFilter::unseen_places(const TeamInterval& interval,
                                                       bool are_placed) {
  constexpr double kClearlyBetter = 0.5;  // of the variances
  std::map<RobotId, TeamPlace> places = unseen_.places(interval, belief_);
  std::erase_if(places, [&](const auto& entry) {
    const auto& [id, place] = entry;
    const auto robot = belief_.robots.find(id);
    if (robot == belief_.robots.end() || !are_placed) return false;
    if (!robot->second.is_trusted ||
        place.doubt() < kClearlyBetter * TeamPlace::of(belief_, id).doubt()) {
      place_member(id, place);
      // One that is on probation already need not wait for readings that agree, once more.
      if (robot->second.is_trusted) robot->second.since = belief_.stamp;
      robot->second.is_trusted = false;
    }
    return true;
  });
  return places;
}

void TeamFilter::add_member(const TeamInterval& interval, RobotId id, const TeamPlace& place) {
  TeamRobot& robot = belief_.robots[id];
  robot.motion_index = belief_.append(FreeMotionAt::kMotion, 0.0);
  robot.bias_index = belief_.append_calibration(interval.settings.priors);
  robot.since = belief_.stamp;
  place_member(id, place);
}

void TeamFilter::place_member(RobotId id, const TeamPlace& place) {
  MotionMatrix floor = MotionMatrix::Zero();
  const double doubt = trust_.doubt(id, belief_.stamp);
  floor.diagonal().head<3>().setConstant(std::pow(doubt * kStartPosition, 2));
  floor.diagonal().segment<3>(3).setConstant((doubt * doubt - 1.0) *
                                             std::pow(NeighborEstimate::kSpeedSigma, 2));
  floor.diagonal().tail<3>().setConstant(std::pow(doubt * kStartAttitude, 2));
  if (const auto turn = trust_.turn_covariance(id)) floor.bottomRightCorner<3, 3>() += *turn;
  belief_.place(id, {place.T_S_N.p, place.v_S_N, place.T_S_N.q}, place.covariance + floor);
  const auto via = belief_.robots.find(place.via);
  if (via != belief_.robots.end() && via->second.motion_index >= 0)
    belief_.connect(id, place.via, place.by_via, place.of_step + floor);
  belief_.robots.at(id).last_sighting = place.last_sighting;
  belief_.robots.at(id).last_fix = place.last_fix;
}

void TeamFilter::report(const TeamInterval& interval, bool are_placed,
                        TeamSolution& solution) const {
  const TeamArcs arcs(belief_);
  for (const auto& [id, robot] : belief_.robots) {
    // On probation, or placed just now, it is known worse than by its pair's filter, if there is
    // one.
    const bool is_new = !robot.is_trusted || !are_placed;
    if (robot.motion_index < 0 || (is_new && has_own_edge(interval, id))) continue;
    TeamPose& pose =
        solution.poses.emplace_back(keyframe_pose(belief_, arcs, id, *interval.member(id)));
    // The estimate that it started from may be false.
    pose.needs_confirmation = !robot.is_trusted && !has_plausible_place(belief_, id);
    pose.was_knocked = is_knocked(id) || is_knocked(belief_.self);
  }
  std::ranges::sort(solution.poses, {}, &TeamPose::neighbor);
  solution.calibrations = calibrations_of(belief_, interval.settings.priors);
  solution.faults = faults_of(belief_, solution.calibrations);
  for (const TeamFault& fault : trust_.gyro_faults(interval.from)) solution.faults.push_back(fault);
  for (const TeamFault& fault : estimates_.faults()) solution.faults.push_back(fault);
}

}  // namespace crepes
