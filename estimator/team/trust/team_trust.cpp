#include "estimator/team/trust/team_trust.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "estimator/team/trust/misalignment_check.hpp"
#include "estimator/team/trust/team_faults.hpp"
#include "estimator/team/trust/witnesses.hpp"

namespace crepes {
namespace {

constexpr double kMaxPosition = 3.0;                         // m; a robot known worse is dropped
constexpr Duration kVerdictLife = std::chrono::seconds{20};  // then a camera is tried again
constexpr int kRefusedAt = 4;  // convictions: realigned, as calibrated, realigned, refused
constexpr Duration kProbation = std::chrono::seconds{1};
constexpr Duration kLateProbation = std::chrono::seconds{3};
constexpr double kAgreed = 4.0;    // times what contradicts
constexpr int kMostDoublings = 5;  // of a probation, that is 32 s
constexpr Duration kLossMemory = std::chrono::seconds{10};
constexpr Duration kMisplacedRecord = std::chrono::seconds{60};  // then ranges may be repaired
constexpr int kMostRestarts = 2;  // of an attitude, within kLossMemory
constexpr double kDoubtPerLoss = 4.0;
constexpr double kTurnedChi2 = 25.0;  // exceeded by one right camera in 65,000
constexpr double kGyroMemory = 0.5;   // s
constexpr double kFalseGyro = 60.0;   // chi-square within that time
constexpr Duration kGyroRefusal = std::chrono::seconds{1};
constexpr Duration kGyroRecord = std::chrono::seconds{60};  // then it is as good as any other
constexpr Duration kStrained = std::chrono::seconds{2};     // by a false gyroscope
constexpr Duration kUnconfirmed = std::chrono::seconds{2};  // a gyroscope may go on being false
constexpr double kLeap = 400.0;  // chi-square of two degrees of freedom: 20 sigma
constexpr Duration kKnock = std::chrono::seconds{2};  // then its bearings contradict
constexpr int kLeastRefused = 3;                      // pairs

/// Whether a camera contradicts a robot and agrees with none.
bool contradicts_all(const TeamCamera& camera) {
  const auto any = [&](auto holds) {
    return std::ranges::any_of(camera.agreement,
                               [&](const auto& entry) { return holds(entry.second); });
  };
  return any([](const Agreement& a) { return a.is_contradiction(); }) &&
         !any([](const Agreement& a) { return !a.is_contradiction() && a.fused > 1.0; });
}

}  // namespace

std::vector<RobotId> TeamTrust::note_false_gyros(const TeamInterval& interval,
                                                 const TeamBelief& belief,
                                                 const std::map<RobotId, GyroCheck>& checks) {
  const double kept = std::exp(-to_seconds(interval.to - interval.from) / kGyroMemory);
  for (auto& [id, doubt] : gyro_doubts_) doubt.chi2 *= kept;
  std::vector<RobotId> robots;
  for (const auto& [id, check] : checks) {
    if (!check.contradiction) {
      const auto doubt = gyro_doubts_.find(id);
      if (check.is_confirmed && doubt != gyro_doubts_.end() && !doubt->second.confirmed)
        doubt->second.confirmed = belief.stamp;
      continue;
    }
    GyroDoubt& doubt = gyro_doubts_[id];
    // A leap ends within an interval; a rate goes on.
    if (check.contradiction->may_be_leap && std::exchange(doubt.leap, interval.to) < interval.from)
      continue;
    doubt.chi2 += check.contradiction->chi2;
    if (doubt.chi2 <= kFalseGyro) continue;
    doubt.found = belief.stamp;
    doubt.rate_radps = check.contradiction->rate_radps;
    const bool is_trusted = belief.robots.at(id).is_trusted;
    if (is_trusted || may_be_disoriented(id, belief.stamp)) {
      doubt.unconfirmed = belief.stamp;
      doubt.confirmed.reset();
    }
    if (is_trusted) {
      const bool is_repeated = belief.stamp - doubt.as_trusted.last < kGyroRecord;
      doubt.as_trusted = {belief.stamp, is_repeated ? doubt.as_trusted.count + 1 : 1};
    }
    robots.push_back(id);
    // The gyroscope may have caused what its camera was blamed for.
    if (const auto verdict = verdicts_.find(id); verdict != verdicts_.end())
      verdict->second.is_withdrawn = true;
  }
  for (const auto& [id, robot] : belief.robots) {
    if (is_disoriented(belief, id) && std::ranges::find(robots, id) == robots.end())
      robots.push_back(id);
  }
  return robots;
}

void TeamTrust::note_leaps(const TeamInterval& interval, const TeamBelief& belief,
                           const std::vector<TeamResidual>& residuals) {
  struct Sights {
    int seen = 0;
    int leapt = 0;
  };
  std::map<std::pair<RobotId, int>, Sights> cameras;
  for (const TeamResidual& residual : residuals) {
    if (residual.kind != TeamResidual::Kind::kBearing || residual.dimension == 0) continue;
    Sights& sights = cameras[{residual.observer, residual.camera}];
    ++sights.seen;
    sights.leapt += residual.fused == 0 && residual.nis > kLeap ? 1 : 0;
  }
  for (const auto& [key, sights] : cameras) {
    const auto& [id, index] = key;
    if (sights.leapt < 2 || 2 * sights.leapt <= sights.seen || !belief.robots.at(id).is_trusted)
      continue;
    const auto camera = static_cast<std::size_t>(index);
    const bool agreed_until_now =
        std::ranges::none_of(belief.robots.at(id).cameras.at(camera).agreement,
                             [](const auto& entry) { return entry.second.is_contradiction(); });
    if (agreed_until_now) leaps_[{id, camera}] = interval.to;
  }
}

/// Whether its gyroscope was recently false, so that the states that it has disturbed may still
/// look as if its camera were turned.
bool TeamTrust::is_strained(RobotId robot, Timestamp now) const {
  const auto doubt = gyro_doubts_.find(robot);
  if (doubt == gyro_doubts_.end() || !doubt->second.found) return false;
  return now - *doubt->second.found < kStrained || may_be_disoriented(robot, now);
}

/// Whether its gyroscope was false while it was trusted, and its cameras have not confirmed it
/// since, or only of late: it may have been false for longer than it was found to be.
bool TeamTrust::may_be_disoriented(RobotId robot, Timestamp now) const {
  const auto entry = gyro_doubts_.find(robot);
  if (entry == gyro_doubts_.end() || !entry->second.unconfirmed) return false;
  const GyroDoubt& doubt = entry->second;
  const Timestamp last = std::min(doubt.confirmed.value_or(now), *doubt.unconfirmed + kUnconfirmed);
  return now - last < kStrained;
}

bool TeamTrust::is_disoriented(const TeamBelief& belief, RobotId id) const {
  return may_be_disoriented(id, belief.stamp) &&
         std::ranges::any_of(belief.robots.at(id).cameras, [&](const TeamCamera& camera) {
           return contradicts_all(camera) || looks_turned(belief, id, camera, false);
         });
}

bool TeamTrust::is_everybody_strained(Timestamp now) const {
  return std::ranges::any_of(gyro_doubts_, [&](const auto& entry) {
    const Losses& as_trusted = entry.second.as_trusted;
    return as_trusted.count > 0 && now - as_trusted.last < kStrained;
  });
}

std::vector<RobotId> TeamTrust::note_lost(const TeamInterval& interval, const TeamBelief& belief) {
  // A robot that was away may have been repaired.
  const auto is_away = [&](const auto& entry) { return interval.member(entry.first) == nullptr; };
  std::erase_if(verdicts_, is_away);
  std::erase_if(losses_, is_away);
  std::erase_if(restarts_, is_away);
  std::erase_if(misled_by_, is_away);
  std::erase_if(misplaced_, is_away);
  std::erase_if(leaps_, [&](const auto& entry) { return is_away(entry.first); });
  // A robot with a false gyroscope may be silent for that very reason.
  std::erase_if(gyro_doubts_, [&](const auto& entry) {
    return is_away(entry) && belief.stamp - entry.second.as_trusted.last >= kGyroRecord;
  });
  review_verdicts(interval, belief);
  const auto is_turned_of = [&](RobotId id, const TeamCamera& camera) {
    return looks_turned(belief, id, camera, verdicts_.contains(id));
  };
  // Its attitude may have gone wrong, as by a gyroscope that was false for a moment, and it is
  // restarted. This robot's own attitude is known by definition.
  const auto is_alone_of = [&](RobotId id, const TeamCamera& camera) {
    return id != belief.self && recent(restarts_, id, belief.stamp) < kMostRestarts &&
           is_alone(belief, id, camera) && !is_turned_of(id, camera);
  };
  // All that a knocked camera sees would be lost before it is found out.
  const auto has_leapt_of = [&](RobotId id, const TeamCamera& camera) {
    const auto index = static_cast<std::size_t>(&camera - belief.robots.at(id).cameras.data());
    return has_leapt(id, index, belief.stamp);
  };
  const Witnesses all = witnesses_of(belief, [&](RobotId id, const TeamCamera& camera) {
    return has_leapt_of(id, camera) || is_turned_of(id, camera) || is_alone_of(id, camera) ||
           is_disoriented(belief, id);
  });
  std::vector<RobotId> lost;
  for (const auto& [id, robot] : belief.robots) {
    // Its camera was left out for long enough.
    const bool is_tried_again =
        !verdicts_.contains(id) && std::ranges::any_of(robot.cameras, &TeamCamera::is_refused);
    if (is_tried_again) lost.push_back(id);
    if (is_tried_again || id == belief.self) continue;
    const double variance = belief.P.diagonal().segment<3>(robot.motion_index).sum();
    const bool has_imu = interval.member(id) != nullptr;
    const bool is_wrong =
        has_imu && (note_misplaced(belief, id) || is_contradicted(belief, all, id));
    const bool is_restarted = has_imu && !is_disoriented(belief, id) &&
                              std::ranges::any_of(robot.cameras, std::bind_front(is_alone_of, id));
    if (is_wrong) count(losses_, id, belief.stamp);
    if (is_restarted) count(restarts_, id, belief.stamp);
    if (is_wrong || is_restarted || !has_imu || !(variance < kMaxPosition * kMaxPosition))
      lost.push_back(id);
  }
  return lost;
}

/// If ranges contradict its next place, too, they are false.
bool TeamTrust::note_misplaced(const TeamBelief& belief, RobotId id) {
  const auto last = misplaced_.try_emplace(id, kNever).first;
  const bool is_new = belief.stamp - last->second >= kMisplacedRecord && is_misplaced(belief, id);
  if (is_new) last->second = belief.stamp;
  return is_new;
}

std::vector<RobotId> TeamTrust::note_turned(const TeamInterval& interval,
                                            const TeamBelief& belief) {
  std::vector<RobotId> turned;
  // All that is known is relative to this robot.
  if (is_strained(belief.self, belief.stamp)) return turned;
  for (const auto& [id, robot] : belief.robots) {
    if (is_strained(id, belief.stamp)) continue;
    for (std::size_t i = 0; i < robot.cameras.size(); ++i) {
      const TeamCamera& camera = robot.cameras[i];
      const bool contradicts = looks_turned(belief, id, camera, verdicts_.contains(id));
      // What a camera that may be turned has learned of late may be what strained the team.
      const bool is_settling = is_realigned(id) || (camera.is_free && verdicts_.contains(id));
      const MisalignmentCheck check =
          is_settling ? MisalignmentCheck{}
                      : misalignment_check(belief, camera, interval.settings.priors);
      if (!contradicts && check.chi2 <= kTurnedChi2) continue;
      convict(id, i, belief.stamp, check.turn);
      turned.push_back(id);
      break;
    }
  }
  return turned;
}

/// A verdict lasts for some time after the camera was last found turned. A robot that was convicted
/// wrongly, or was repaired, then starts like any other.
void TeamTrust::review_verdicts(const TeamInterval& interval, const TeamBelief& belief) {
  for (auto& [id, verdict] : verdicts_) {
    if (verdict.is_refused || !belief.robots.contains(id)) continue;
    for (const CameraMisalignment& camera : belief.calibration(id).cameras)
      if (is_turned(camera, interval.settings.priors)) verdict.shown = belief.stamp;
  }
  std::erase_if(verdicts_, [&](const auto& entry) {
    return belief.stamp - entry.second.shown >= kVerdictLife;
  });
}

/// A realigned camera that contradicts the others again may be as calibrated again: repaired, or
/// its robot has ceased to lie. So its verdict is withdrawn before it is refused. Also withdraws
/// the verdict of robots that were convicted once before: this robot had disturbed the states on
/// which they were judged. A camera that is knocked, or knocked back, has disturbed none.
void TeamTrust::convict(RobotId robot, std::size_t camera, Timestamp now,
                        const Eigen::Vector3d& turn) {
  Verdict& verdict = verdicts_[robot];
  const bool was_realigned = verdict.count > 0 && !verdict.is_withdrawn;
  ++verdict.count;
  verdict.knocked = has_leapt(robot, camera, now) ? std::optional(camera) : std::nullopt;
  verdict.is_refused = was_realigned && verdict.count >= kRefusedAt;
  verdict.is_withdrawn = was_realigned && !verdict.is_refused && !verdict.knocked;
  verdict.shown = now;
  // Since a leap its bearings were refused, and say nothing of the axis.
  verdict.covariance =
      turned_covariance(verdict.knocked ? Eigen::Vector3d::Zero().eval() : turn.eval());
  if (verdict.knocked) return;
  for (auto& [id, other] : verdicts_)
    if (id != robot && other.count == 1 && !other.knocked) other.is_withdrawn = true;
}

std::optional<Eigen::Matrix3d> TeamTrust::turn_covariance(RobotId robot) const {
  if (!is_realigned(robot)) return std::nullopt;
  return verdicts_.at(robot).covariance;
}

bool TeamTrust::is_realigned(RobotId robot) const {
  const auto found = verdicts_.find(robot);
  return found != verdicts_.end() && !found->second.is_withdrawn;
}

double TeamTrust::doubt(RobotId robot, Timestamp now) const {
  const int steps = std::max(std::min(recent(losses_, robot, now), 2),
                             std::min(recent(restarts_, robot, now), 1));
  return std::pow(kDoubtPerLoss, steps);
}

int TeamTrust::recent(const std::map<RobotId, Losses>& all, RobotId robot, Timestamp now) {
  const auto found = all.find(robot);
  const bool is_recent = found != all.end() && now - found->second.last < kLossMemory;
  return is_recent ? found->second.count : 0;
}

void TeamTrust::count(std::map<RobotId, Losses>& all, RobotId robot, Timestamp now) {
  all[robot] = {now, recent(all, robot, now) + 1};
}

bool TeamTrust::note_misleading(const TeamBelief& belief) {
  int refused = 0;
  int fitting = 0;
  std::map<RobotId, int> refused_of;
  std::map<RobotId, int> fitting_of;
  for (const auto& [pair, range] : belief.ranges) {
    const auto has = [&agreement = range.agreement](auto holds) {
      return std::ranges::any_of(agreement, [&](const auto& entry) { return holds(entry.second); });
    };
    if (has([](const Agreement& a) { return a.is_contradiction(); })) {
      ++refused;
      ++refused_of[pair.first];
      ++refused_of[pair.second];
    } else if (has([](const Agreement& a) { return a.fused > 1.0; })) {
      ++fitting;
      ++fitting_of[pair.first];
      ++fitting_of[pair.second];
    }
  }
  if (refused < kLeastRefused || refused < fitting) return false;
  // If one robot is part of all, its ranges are false, and not the others'.
  const auto is_in_all = [&](const auto& entry) { return entry.second == refused; };
  if (std::ranges::any_of(refused_of, is_in_all)) return false;
  bool is_new = false;
  for (const auto& [id, pairs] : fitting_of) {
    if (id == belief.self || pairs < fitting || has_misled(id, belief.stamp)) continue;
    misled_by_[id] = belief.stamp;
    is_new = true;
  }
  return is_new;
}

bool TeamTrust::has_misled(RobotId robot, Timestamp now) const {
  const auto found = misled_by_.find(robot);
  return found != misled_by_.end() && now - found->second < kLossMemory;
}

void TeamTrust::end_probations(TeamBelief& belief) const {
  const Witnesses all = bearings_of(belief);
  for (auto& [id, robot] : belief.robots) {
    const auto votes = all.find(id);
    const bool is_long_enough = belief.stamp - robot.since >= probation(id, belief.stamp);
    if (is_long_enough && votes != all.end() &&
        votes->second.agree > kAgreed * votes->second.contradict + 2.0 &&
        !is_placed_by_its_own_ranges(belief, id))
      robot.is_trusted = true;
  }
}

/// A gyroscope that is false now and then costs everybody something each time that its robot is
/// trusted. So each time the next probation is twice as long.
Duration TeamTrust::probation(RobotId robot, Timestamp now) const {
  const Duration least = has_misled(robot, now) ? kLateProbation : kProbation;
  const auto doubt = gyro_doubts_.find(robot);
  if (doubt == gyro_doubts_.end() || now - doubt->second.as_trusted.last >= kGyroRecord)
    return least;
  const int repeated = std::clamp(doubt->second.as_trusted.count - 1, 0, kMostDoublings);
  return std::max(least, kProbation * (1 << repeated));
}

std::vector<TeamFault> TeamTrust::gyro_faults(Timestamp now) const {
  std::vector<TeamFault> faults;
  for (const auto& [id, doubt] : gyro_doubts_) {
    if (is_gyro_false(id, now)) faults.push_back({id, TeamFault::Kind::kGyro, doubt.rate_radps});
  }
  return faults;
}

bool TeamTrust::is_gyro_false(RobotId robot, Timestamp now) const {
  const auto doubt = gyro_doubts_.find(robot);
  return doubt != gyro_doubts_.end() && doubt->second.found &&
         now - *doubt->second.found < kGyroRefusal;
}

std::optional<std::size_t> TeamTrust::knocked_camera(RobotId robot) const {
  if (!is_realigned(robot) || is_refused(robot)) return std::nullopt;
  return verdicts_.at(robot).knocked;
}

bool TeamTrust::has_leapt(RobotId robot, std::size_t camera, Timestamp now) const {
  const auto leap = leaps_.find({robot, camera});
  return leap != leaps_.end() && now - leap->second < kKnock && !is_gyro_false(robot, now);
}

bool has_plausible_place(const TeamBelief& belief, RobotId id) {
  if (belief.stamp <= belief.robots.at(id).since || ranges_of(belief, id).is_contradiction())
    return false;
  const Witnesses all = bearings_of(belief);
  const auto votes = all.find(id);
  return votes == all.end() || votes->second.agree >= kAgreed * votes->second.contradict;
}

}  // namespace crepes
