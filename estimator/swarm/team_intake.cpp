#include "estimator/swarm/team_intake.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/swarm/robot_state.hpp"
#include "estimator/team/belief/team_state.hpp"

namespace crepes {
namespace {

constexpr double kLeastBearingSigma = 2e-4;  // rad; no camera is better, whatever a peer says
constexpr Duration kLongest = std::chrono::milliseconds{500};  // of an interval
constexpr std::size_t kMaxWaiting = 20000;  // if nothing is drained, for lack of own samples

bool is_other_member(RobotId robot, RobotId sender, const SwarmConfig& swarm) {
  return robot != sender &&
         std::ranges::find(swarm.members, robot, &MemberConfig::id) != swarm.members.end();
}

// Moves the measurements until `to` into the result, ordered by stamp; drops those before `from`.
template <class Reading, class StampOf>
std::vector<Reading> drained(std::vector<Reading>& waiting, Timestamp from, Timestamp to,
                             const StampOf& stamp_of) {
  const auto later = std::stable_partition(waiting.begin(), waiting.end(),
                                           [&](const Reading& r) { return stamp_of(r) <= to; });
  std::vector<Reading> result(waiting.begin(), later);
  waiting.erase(waiting.begin(), later);
  std::erase_if(result, [&](const Reading& r) { return stamp_of(r) <= from; });
  std::stable_sort(result.begin(), result.end(),
                   [&](const Reading& a, const Reading& b) { return stamp_of(a) < stamp_of(b); });
  return result;
}

/// The readings that are newer than their source's before, which are these from then on.
template <class Reading, class SourceOf, class Source>
std::vector<Reading> newer(const std::vector<Reading>& readings, const SourceOf& source_of,
                           std::map<Source, Timestamp>& newest) {
  std::vector<Reading> news;
  std::ranges::copy_if(readings, std::back_inserter(news), [&](const Reading& reading) {
    const auto known = newest.find(source_of(reading));
    return known == newest.end() || reading.stamp > known->second;
  });
  for (const Reading& reading : news) {
    Timestamp& stamp = newest.try_emplace(source_of(reading), reading.stamp).first->second;
    stamp = std::max(stamp, reading.stamp);
  }
  return news;
}

TeamMember member_over(const MemberConfig& config, const ImuHistory& imu,
                       const TeamInterval& interval) {
  TeamMember member{config.id, config.p_body_led, config.p_body_uwb, {}};
  for (Timestamp t = interval.from; t < interval.to; t += TeamInterval::kStep)
    member.imu.push_back(imu.mean(t, std::min(interval.to, t + TeamInterval::kStep)));
  return member;
}

}  // namespace

void TeamIntake::add_report(const Report& report, double turn_sigma_rad, const SwarmConfig& swarm,
                            const FilterSettings& settings) {
  for (Bearing bearing : report.bearings) {
    if (!is_other_member(bearing.neighbor, report.sender, swarm)) continue;
    bearing.sigma_rad = std::max(std::hypot(bearing.sigma_rad, turn_sigma_rad), kLeastBearingSigma);
    record_delay(bearing.stamp);
    if (bearings_.size() < kMaxWaiting) bearings_.push_back({report.sender, bearing});
  }
  for (const UwbRange& range : report.ranges) {
    if (is_other_member(range.neighbor, report.sender, swarm))
      add_range(report.sender, range, settings);
  }
}

void TeamIntake::add_own_report(const Report& report, const SwarmConfig& swarm,
                                const FilterSettings& settings) {
  Report news;
  news.sender = report.sender;
  const auto camera_of = [](const Bearing& bearing) {
    const Eigen::Vector3d& p = bearing.p_B_C;
    return std::pair(bearing.neighbor, CameraPlace{p.x(), p.y(), p.z()});
  };
  news.bearings = newer(report.bearings, camera_of, newest_own_bearing_);
  news.ranges = newer(
      report.ranges, [](const UwbRange& range) { return range.neighbor; }, newest_own_range_);
  add_report(news, 0.0, swarm, settings);
}

void TeamIntake::record_delay(Timestamp stamp) {
  if (now_ != kNever) lag_.add(now_ - stamp);
}

void TeamIntake::add_range(RobotId observer, const UwbRange& range,
                           const FilterSettings& settings) {
  record_delay(range.stamp);
  if (ranges_.size() >= kMaxWaiting) return;
  const auto reading = screens_[ordered(observer, range.neighbor)].accept(range, settings);
  if (reading) ranges_.push_back({observer, range.neighbor, range.stamp, *reading});
}

std::optional<TeamInterval> TeamIntake::drain(RobotId self, Timestamp now, const SwarmConfig& swarm,
                                              const FilterSettings& settings, const ImuOf& imu_of) {
  now_ = now;
  lag_.set_least(settings.lag);
  const Timestamp to = now - lag_.value();
  if (to <= last_) return std::nullopt;
  TeamInterval interval;
  interval.self = self;
  interval.from = std::max(last_, to - kLongest);
  interval.to = to;
  last_ = to;
  const auto stamp_of_bearing = [](const TeamBearing& r) { return r.bearing.stamp; };
  const auto stamp_of_range = [](const TeamRange& r) { return r.stamp; };
  interval.bearings = drained(bearings_, interval.from, to, stamp_of_bearing);
  interval.ranges = drained(ranges_, interval.from, to, stamp_of_range);
  for (const MemberConfig& member : swarm.members) {
    const ImuHistory* imu = imu_of(member.id);
    if (imu == nullptr || imu->newest().stamp < to - RobotState::kImuSilence) continue;
    interval.members.push_back(member_over(member, *imu, interval));
  }
  interval.settings = {.noise = settings.noise,
                       .priors = settings.priors,
                       .bearing_gate = settings.gates.bearing,
                       .range_gate = settings.gates.range};
  return interval;
}

}  // namespace crepes
