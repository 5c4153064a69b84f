#include "estimator/team/unseen/unseen_robots.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace crepes {
namespace {

// The accelerometers' biases bend a track of 5 s by less than beacons err.
constexpr Duration kLeast = std::chrono::seconds{2};
constexpr Duration kMost = std::chrono::seconds{5};
constexpr Duration kTrial = std::chrono::seconds{1};
constexpr Duration kRound = std::chrono::milliseconds{100};  // by which robots take turns

/// Members that no camera sees, and whose cameras see nobody.
std::set<RobotId> unseen_of(const TeamInterval& interval) {
  std::set<RobotId> unseen;
  for (const TeamMember& member : interval.members) unseen.insert(member.robot);
  unseen.erase(interval.self);
  for (const TeamBearing& reading : interval.bearings) {
    unseen.erase(reading.observer);
    unseen.erase(reading.bearing.neighbor);
  }
  return unseen;
}

bool is_beacon(const TeamInterval& interval, const TeamBelief& belief, RobotId id) {
  const auto robot = belief.robots.find(id);
  return robot != belief.robots.end() && robot->second.is_trusted &&
         !robot->second.is_unseen(interval.to) && interval.member(id) != nullptr;
}

/// Of an interval's ranges between two robots. Their errors last longer than the interval, so the
/// mean is no better than one of them.
class MeanRange {
 public:
  void add(double t_s, const RangeReading& reading) {
    t_sum_s_ += t_s;
    range_sum_m_ += reading.range_m;
    variance_sum_m2_ += reading.sigma_m * reading.sigma_m;
    count_ += 1.0;
  }
  [[nodiscard]] double t_s() const { return t_sum_s_ / count_; }
  [[nodiscard]] RangeReading reading(double delay_m) const {
    return {range_sum_m_ / count_ - delay_m, std::sqrt(variance_sum_m2_ / count_)};
  }

 private:
  double t_sum_s_ = 0.0;
  double range_sum_m_ = 0.0;
  double variance_sum_m2_ = 0.0;
  double count_ = 0.0;
};

/// By the unseen robot and the beacon.
std::map<std::pair<RobotId, RobotId>, MeanRange> mean_ranges(const TeamInterval& interval,
                                                             const TeamBelief& belief,
                                                             const std::set<RobotId>& unseen) {
  std::map<std::pair<RobotId, RobotId>, MeanRange> means;
  for (const TeamRange& z : interval.ranges) {
    const bool is_observer = unseen.contains(z.observer);
    const RobotId id = is_observer ? z.observer : z.neighbor;
    const RobotId beacon = is_observer ? z.neighbor : z.observer;
    if (interval.contains(z.stamp) && unseen.contains(id) && is_beacon(interval, belief, beacon))
      means[{id, beacon}].add(to_seconds(z.stamp - interval.from), z.reading);
  }
  return means;
}

}  // namespace

void UnseenRobots::add(const TeamInterval& interval, const TeamBelief& belief) {
  if (interval.from != end_) unseen_.clear();
  end_ = interval.to;
  const std::set<RobotId> present = unseen_of(interval);
  std::erase_if(unseen_, [&](const auto& entry) { return !present.contains(entry.first); });
  if (present.empty()) return;

  const double duration_s = to_seconds(interval.to - interval.from);
  for (const RobotId id : present) {
    Unseen& unseen = unseen_[id];
    unseen.intervals.push_back({.duration_s = duration_s,
                                .imu = interval.member(id)->imu,
                                .self_imu = interval.member(belief.self)->imu,
                                .ranges = {}});
    unseen.since += interval.to - interval.from;
    unseen.lasted += interval.to - interval.from;
    while (unseen.lasted > kMost) {
      unseen.lasted -= from_seconds(unseen.intervals.front().duration_s);
      unseen.intervals.pop_front();
    }
  }
  for (const auto& [pair, mean] : mean_ranges(interval, belief, present)) {
    const auto& [id, beacon] = pair;
    const TeamRobot& robot = belief.robots.at(beacon);
    const TeamMember& member = *interval.member(beacon);
    const RobotTrajectory path(robot.motion, robot.bias, member.imu, duration_s,
                               interval.settings.noise);
    const FreeMotion motion = path.motion_at(mean.t_s());
    unseen_.at(id).intervals.back().ranges.push_back(
        {.beacon = beacon,
         .t_s = mean.t_s(),
         .reading = mean.reading(robot.antenna_delay_m),
         .p_F_beacon = motion.p_F + motion.q_F_B * member.p_body_uwb,
         .beacon_variance_m2 = belief.position_covariance(belief.self, beacon).trace()});
  }
}

std::map<RobotId, TeamPlace> UnseenRobots::places(const TeamInterval& interval,
                                                  const TeamBelief& belief) const {
  std::map<RobotId, TeamPlace> places;
  const TeamRobot& self = belief.robots.at(belief.self);
  for (const auto& [id, unseen] : unseen_) {
    const Duration turn = unseen.since + id.value * kRound;
    const bool is_due = turn / kTrial != (turn - (interval.to - interval.from)) / kTrial;
    if (unseen.lasted < kLeast || !is_due) continue;
    const auto place = place_by_ranges(
        unseen.intervals,
        {.p_body_uwb = interval.member(id)->p_body_uwb,
         .self_bias = self.bias,
         .self_gyro_variance = belief.P.diagonal().segment<3>(self.bias_index).maxCoeff(),
         .self_accel_variance = belief.P.diagonal().segment<3>(self.bias_index + 3).maxCoeff(),
         .noise = interval.settings.noise,
         .priors = interval.settings.priors});
    if (!place) continue;
    places.emplace(id, *place).first->second.last_fix = end_;
  }
  return places;
}

}  // namespace crepes
