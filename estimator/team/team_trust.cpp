#include "estimator/team/team_trust.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/team/team_faults.hpp"

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
constexpr int kMostRestarts = 2;  // of an attitude, within kLossMemory
constexpr double kDoubtPerLoss = 4.0;
constexpr double kTurnedChi2 = 25.0;  // exceeded by one right camera in 65,000
// Sigmas of a turned camera about the axis of its turn, and across.
constexpr double kTurn = radians(20.0);       // rad
constexpr double kTurnAcross = radians(2.0);  // rad
constexpr double kGyroMemory = 0.5;           // s
constexpr double kFalseGyro = 60.0;           // chi-square within that time
constexpr Duration kGyroRefusal = std::chrono::seconds{1};
constexpr Duration kGyroRecord = std::chrono::seconds{60};  // then it is as good as any other
constexpr Duration kStrained = std::chrono::seconds{2};     // by a false gyroscope
constexpr int kLeastRefused = 3;                            // pairs

/// How many cameras or bearings agree with each robot's place, and how many contradict it.
using Witnesses = std::map<RobotId, Agreement>;
using Robots = std::map<RobotId, TeamRobot>;

/// What was measured of a camera's misalignment, against its prior.
struct MisalignmentTest {
  double chi2 = 0.0;  ///< of three degrees of freedom, if the camera is as it was calibrated
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< its significant components
};

/// A camera that may be turned has no prior that draws its estimate to zero.
MisalignmentTest tested_without_prior(const TeamBelief& belief, const TeamCamera& camera,
                                      const Priors& priors) {
  const Eigen::Matrix3d covariance =
      belief.P.block<3, 3>(camera.index, camera.index) +
      std::pow(believed_misalignment(priors), 2) * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d& m = camera.misalignment;
  return {.chi2 = m.dot(covariance.llt().solve(m)), .turn = m};
}

/// The prior draws the estimate to zero, so a turn is significant long before the estimate is
/// large. The difference of two estimates, the second of which uses more data, has the difference
/// of their covariances (Hausman 1978). In the axes of that difference, the data alone give the
/// mean m P0 / (P0 - P) and the variance P P0 / (P0 - P).
MisalignmentTest tested(const TeamBelief& belief, const TeamCamera& camera, const Priors& priors) {
  // A share of the prior's variance. An axis that taught less is unknown.
  constexpr double kObserved = 1e-4;
  if (camera.is_free) return tested_without_prior(belief, camera, priors);
  const double prior = std::max(std::pow(priors.misalignment_rad, 2), TeamBelief::kLeastVariance);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> learned(
      prior * Eigen::Matrix3d::Identity() - belief.P.block<3, 3>(camera.index, camera.index));
  MisalignmentTest test;
  for (int i = 0; i < 3; ++i) {
    const double difference = learned.eigenvalues()(i);
    if (difference < kObserved * prior) continue;
    const Eigen::Vector3d axis = learned.eigenvectors().col(i);
    const double mean = axis.dot(camera.misalignment) * prior / difference;
    const double variance = (prior - difference) * prior / difference;
    const double chi2 = mean * mean / (variance + std::pow(believed_misalignment(priors), 2));
    test.chi2 += chi2;
    test.turn += chi2 * mean * axis;
  }
  return test;
}

/// Of a camera that is turned about this axis, in the body's axes. Its length does not matter;
/// zero: any.
Eigen::Matrix3d turned_covariance(const Eigen::Vector3d& axis) {
  const Eigen::Matrix3d along = axis.isZero(0.0)
                                    ? Eigen::Matrix3d::Identity().eval()
                                    : (axis * axis.transpose() / axis.squaredNorm()).eval();
  return kTurn * kTurn * along + kTurnAcross * kTurnAcross * Eigen::Matrix3d::Identity();
}

/// A camera that is refused or excluded is no witness.
template <class IsExcluded>
Witnesses witnesses(const Robots& robots, const IsExcluded& is_excluded) {
  Witnesses witnesses;
  for (const auto& [id, robot] : robots) {
    for (const TeamCamera& camera : robot.cameras) {
      if (camera.is_refused || is_excluded(id, camera)) continue;
      for (const auto& [neighbor, agreement] : camera.agreement) {
        Agreement& of_neighbor = witnesses[neighbor];
        if (agreement.is_contradiction()) {
          of_neighbor.gated += 1.0;
        } else if (agreement.fused > 1.0) {
          of_neighbor.fused += 1.0;
        }
      }
    }
  }
  return witnesses;
}

/// The ranges of a robot and to it.
Agreement ranges_of(const TeamBelief& belief, RobotId id) {
  Agreement all;
  for (const auto& [pair, range] : belief.ranges) {
    if (pair.first != id && pair.second != id) continue;
    for (const auto& [observer, agreement] : range.agreement) {
      all.fused += agreement.fused;
      all.gated += agreement.gated;
    }
  }
  return all;
}

/// The bearings of each robot and to it.
Witnesses bearings_of(const Robots& robots) {
  Witnesses all;
  for (const auto& [id, robot] : robots) {
    for (const TeamCamera& camera : robot.cameras) {
      for (const auto& [neighbor, agreement] : camera.agreement) {
        for (const RobotId end : {id, neighbor}) {
          all[end].fused += agreement.fused;
          all[end].gated += agreement.gated;
        }
      }
    }
  }
  return all;
}

/// Whether another camera than `observer`'s contradicts the place of `id`.
bool others_contradict(const Robots& robots, RobotId observer, RobotId id) {
  const auto all =
      witnesses(robots, [&](RobotId witness, const TeamCamera&) { return witness == observer; });
  const auto found = all.find(id);
  return found != all.end() && found->second.gated > 0.0;
}

/// It contradicts most of the robots that it sees, at least two since one may itself be in the
/// wrong place.
bool contradicts_most(const TeamCamera& camera) {
  const auto seen = std::ranges::count_if(camera.agreement, [](const auto& entry) {
    return entry.second.fused + entry.second.gated > 1.0;
  });
  const auto contradicted = std::ranges::count_if(
      camera.agreement, [](const auto& entry) { return entry.second.is_contradiction(); });
  return contradicted >= 2 && 2 * contradicted > seen;
}

/// The rule for a camera that was found turned before. It contradicts a robot that no other camera
/// contradicts, of late more often than it agrees with all others: what it agreed with while it was
/// turned says nothing for it now.
bool contradicts_more(const Robots& robots, RobotId observer, const TeamCamera& camera) {
  double agreed = 0.0;
  double contradicted = 0.0;
  for (const auto& [neighbor, agreement] : camera.agreement) {
    if (!agreement.is_contradiction()) {
      agreed += agreement.fused;
    } else if (!others_contradict(robots, observer, neighbor)) {
      contradicted += agreement.gated;
    }
  }
  return contradicted > agreed;
}

/// Nobody contradicts the place of the robot that carries it.
bool is_turned(const Robots& robots, RobotId observer, const TeamCamera& camera, bool was_turned) {
  if (!contradicts_most(camera) && !(was_turned && contradicts_more(robots, observer, camera)))
    return false;
  const auto all = witnesses(robots, [](RobotId, const TeamCamera&) { return false; });
  const auto of_observer = all.find(observer);
  return of_observer == all.end() || of_observer->second.gated == 0.0;
}

/// It agrees with nobody, and other cameras confirm the place of each robot that it contradicts. So
/// its own attitude is wrong, which no other camera can show.
bool is_alone(const Robots& robots, RobotId observer, const TeamCamera& camera) {
  const auto others =
      witnesses(robots, [&](RobotId witness, const TeamCamera&) { return witness == observer; });
  bool contradicts = false;
  for (const auto& [neighbor, agreement] : camera.agreement) {
    if (agreement.is_contradiction()) {
      contradicts = true;
      const auto found = others.find(neighbor);
      if (found == others.end() || found->second.fused == 0.0 || found->second.gated > 0.0)
        return false;
    } else if (agreement.fused > 1.0) {
      return false;
    }
  }
  return contradicts;
}

bool is_contradicted(const Robots& robots, const Witnesses& all, RobotId id) {
  const auto found = all.find(id);
  if (found == all.end() || found->second.gated == 0.0) return false;
  const Agreement& of_robot = found->second;
  const bool came_last = std::ranges::none_of(all, [&](const auto& other) {
    return other.second.gated > 0.0 && robots.at(other.first).since > robots.at(id).since;
  });
  return of_robot.gated > of_robot.fused || (of_robot.gated == of_robot.fused && came_last);
}

/// Whether the robot's place agrees with the ranges that it measured, but not with those that
/// trusted robots measured to it.
bool is_placed_by_its_own_ranges(const TeamBelief& belief, RobotId id) {
  return std::ranges::any_of(belief.ranges, [&](const auto& entry) {
    const auto& [pair, range] = entry;
    if (pair.first != id && pair.second != id) return false;
    const RobotId other = pair.first == id ? pair.second : pair.first;
    const auto of_other = range.agreement.find(other);
    const auto own = range.agreement.find(id);
    return belief.robots.at(other).is_trusted && of_other != range.agreement.end() &&
           of_other->second.is_contradiction() && own != range.agreement.end() &&
           !own->second.is_contradiction();
  });
}

}  // namespace

std::vector<RobotId> TeamTrust::false_gyros(const TeamInterval& interval, const TeamBelief& belief,
                                            const std::map<RobotId, GyroCheck>& checks) {
  const double kept = std::exp(-to_seconds(interval.to - interval.from) / kGyroMemory);
  for (auto& [id, doubt] : gyro_doubts_) doubt.chi2 *= kept;
  std::vector<RobotId> robots;
  for (const auto& [id, check] : checks) {
    if (!check.contradiction) continue;
    GyroDoubt& doubt = gyro_doubts_[id];
    doubt.chi2 += check.contradiction->chi2;
    if (doubt.chi2 <= kFalseGyro) continue;
    doubt.found = belief.stamp;
    doubt.rate_radps = check.contradiction->rate_radps;
    if (belief.robots.at(id).is_trusted) {
      const bool is_repeated = belief.stamp - doubt.as_trusted.last < kGyroRecord;
      doubt.as_trusted = {belief.stamp, is_repeated ? doubt.as_trusted.count + 1 : 1};
    }
    robots.push_back(id);
    // The gyroscope may have caused what its camera was blamed for.
    if (const auto verdict = verdicts_.find(id); verdict != verdicts_.end())
      verdict->second.is_withdrawn = true;
  }
  return robots;
}

/// Whether its gyroscope was recently false. The states that it has disturbed may still look as if
/// its camera were turned.
bool TeamTrust::is_strained(RobotId robot, Timestamp now) const {
  const auto doubt = gyro_doubts_.find(robot);
  return doubt != gyro_doubts_.end() && doubt->second.found &&
         now - *doubt->second.found < kStrained;
}

bool TeamTrust::is_everybody_strained(Timestamp now) const {
  return std::ranges::any_of(gyro_doubts_, [&](const auto& entry) {
    const Losses& as_trusted = entry.second.as_trusted;
    return as_trusted.count > 0 && now - as_trusted.last < kStrained;
  });
}

std::vector<RobotId> TeamTrust::lost(const TeamInterval& interval, const TeamBelief& belief) {
  // A robot that was away may have been repaired.
  const auto is_away = [&](const auto& entry) { return interval.member(entry.first) == nullptr; };
  std::erase_if(verdicts_, is_away);
  std::erase_if(gyro_doubts_, is_away);
  std::erase_if(losses_, is_away);
  std::erase_if(restarts_, is_away);
  std::erase_if(misled_by_, is_away);
  review_verdicts(interval, belief);
  const auto is_turned_of = [&](RobotId id, const TeamCamera& camera) {
    return is_turned(belief.robots, id, camera, verdicts_.contains(id));
  };
  // Its attitude may have gone wrong, as by a gyroscope that was false for a moment, and it is
  // restarted. This robot's own attitude is known by definition.
  const auto is_alone_of = [&](RobotId id, const TeamCamera& camera) {
    return id != belief.self && recent(restarts_, id, belief.stamp) < kMostRestarts &&
           is_alone(belief.robots, id, camera) && !is_turned_of(id, camera);
  };
  const Witnesses all = witnesses(belief.robots, [&](RobotId id, const TeamCamera& camera) {
    return is_turned_of(id, camera) || is_alone_of(id, camera);
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
    const bool is_wrong = has_imu && is_contradicted(belief.robots, all, id);
    const bool is_restarted =
        has_imu && std::ranges::any_of(robot.cameras, std::bind_front(is_alone_of, id));
    if (is_wrong) count(losses_, id, belief.stamp);
    if (is_restarted) count(restarts_, id, belief.stamp);
    if (is_wrong || is_restarted || !has_imu || !(variance < kMaxPosition * kMaxPosition))
      lost.push_back(id);
  }
  return lost;
}

std::vector<RobotId> TeamTrust::turned(const TeamInterval& interval, const TeamBelief& belief) {
  std::vector<RobotId> turned;
  // All that is known is relative to this robot.
  if (is_strained(belief.self, belief.stamp)) return turned;
  for (const auto& [id, robot] : belief.robots) {
    if (is_strained(id, belief.stamp)) continue;
    for (const TeamCamera& camera : robot.cameras) {
      const bool contradicts = is_turned(belief.robots, id, camera, verdicts_.contains(id));
      // What a camera that may be turned has learned of late may be what strained the team.
      const bool is_settling = is_realigned(id) || (camera.is_free && verdicts_.contains(id));
      const MisalignmentTest test =
          is_settling ? MisalignmentTest{} : tested(belief, camera, interval.settings.priors);
      if (!contradicts && test.chi2 <= kTurnedChi2) continue;
      convict(id, belief.stamp, turned_covariance(test.turn));
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
/// which they were judged.
void TeamTrust::convict(RobotId robot, Timestamp now, const Eigen::Matrix3d& covariance) {
  Verdict& verdict = verdicts_[robot];
  const bool was_realigned = verdict.count > 0 && !verdict.is_withdrawn;
  ++verdict.count;
  verdict.is_refused = was_realigned && verdict.count >= kRefusedAt;
  verdict.is_withdrawn = was_realigned && !verdict.is_refused;
  verdict.shown = now;
  verdict.covariance = covariance;
  for (auto& [id, other] : verdicts_)
    if (id != robot && other.count == 1) other.is_withdrawn = true;
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

bool TeamTrust::is_misled(const TeamBelief& belief) {
  int refused = 0;
  int fitting = 0;
  std::map<RobotId, int> fitting_of;
  for (const auto& [pair, range] : belief.ranges) {
    const auto has = [&agreement = range.agreement](auto holds) {
      return std::ranges::any_of(agreement, [&](const auto& entry) { return holds(entry.second); });
    };
    if (has([](const Agreement& a) { return a.is_contradiction(); })) {
      ++refused;
    } else if (has([](const Agreement& a) { return a.fused > 1.0; })) {
      ++fitting;
      ++fitting_of[pair.first];
      ++fitting_of[pair.second];
    }
  }
  if (refused < kLeastRefused || refused < fitting) return false;
  bool is_misled = false;
  for (const auto& [id, pairs] : fitting_of) {
    if (id == belief.self || pairs < fitting || has_misled(id, belief.stamp)) continue;
    misled_by_[id] = belief.stamp;
    is_misled = true;
  }
  return is_misled;
}

bool TeamTrust::has_misled(RobotId robot, Timestamp now) const {
  const auto found = misled_by_.find(robot);
  return found != misled_by_.end() && now - found->second < kLossMemory;
}

void TeamTrust::end_probations(TeamBelief& belief) const {
  const Witnesses all = bearings_of(belief.robots);
  for (auto& [id, robot] : belief.robots) {
    const auto agreement = all.find(id);
    const bool is_long_enough = belief.stamp - robot.since >= probation(id, belief.stamp);
    if (is_long_enough && agreement != all.end() &&
        agreement->second.fused > kAgreed * agreement->second.gated + 2.0 &&
        !is_placed_by_its_own_ranges(belief, id))
      robot.is_trusted = true;
  }
}

/// A gyroscope that is false now and then costs everybody something each time that its robot is
/// trusted. So each time the next probation is twice as long.
Duration TeamTrust::probation(RobotId robot, Timestamp now) const {
  const Duration least = has_misled(robot, now) ? kLateProbation : kProbation;
  const auto doubt = gyro_doubts_.find(robot);
  if (doubt == gyro_doubts_.end()) return least;
  const int repeated = std::clamp(doubt->second.as_trusted.count - 1, 0, kMostDoublings);
  return std::max(least, kProbation * (1 << repeated));
}

std::vector<TeamFault> TeamTrust::gyro_faults(Timestamp now) const {
  std::vector<TeamFault> faults;
  for (const auto& [id, doubt] : gyro_doubts_) {
    if (doubt.found && now - *doubt.found < kGyroRefusal)
      faults.push_back({id, TeamFault::Kind::kGyro, doubt.rate_radps});
  }
  return faults;
}

bool is_plausible(const TeamBelief& belief, RobotId id) {
  if (belief.stamp <= belief.robots.at(id).since || ranges_of(belief, id).is_contradiction())
    return false;
  const Witnesses all = bearings_of(belief.robots);
  const auto agreement = all.find(id);
  return agreement == all.end() || agreement->second.fused >= kAgreed * agreement->second.gated;
}

}  // namespace crepes
