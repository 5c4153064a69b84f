#include "estimator/team/unseen/team_darkness.hpp"

#include <Eigen/Eigenvalues>
#include <map>

namespace crepes {
namespace {

// Ranges locate a robot in the dark if those who measure them are in different directions from it:
// the least eigenvalue of the sum of u u^T.
constexpr std::size_t kLeastBeacons = 3;
constexpr double kLeastSpread = 0.05;
constexpr double kMostDoubt = 0.7;  // m; sigma of its place; beyond, a range is no plane

}  // namespace

TeamDarkness::TeamDarkness(const TeamInterval& interval, const TeamBelief& belief)
    : interval_(interval), belief_(belief) {
  std::map<RobotId, std::set<RobotId>> beacons;
  for (const TeamRange& reading : interval.ranges) {
    if (!interval.contains(reading.stamp)) continue;
    const auto dark = dark_of(reading);
    if (!dark) continue;
    const RobotId beacon = *dark == reading.observer ? reading.neighbor : reading.observer;
    if (belief.robots.at(beacon).is_trusted) beacons[*dark].insert(beacon);
  }
  for (const auto& [dark, seen] : beacons)
    if (is_located(dark, seen)) located_.insert(dark);
}

bool TeamDarkness::allows(const TeamRange& reading) const {
  if (!is_dark(reading.observer) && !is_dark(reading.neighbor)) return true;
  const auto dark = dark_of(reading);
  return dark && located_.contains(*dark);
}

std::optional<RobotId> TeamDarkness::dark_of(const TeamRange& reading) const {
  if (!belief_.robots.contains(reading.observer) || !belief_.robots.contains(reading.neighbor) ||
      is_dark(reading.observer) == is_dark(reading.neighbor))
    return std::nullopt;
  return is_dark(reading.observer) ? reading.observer : reading.neighbor;
}

bool TeamDarkness::is_dark(RobotId id) const {
  return belief_.robots.at(id).is_unseen(interval_.to);
}

bool TeamDarkness::is_located(RobotId dark, const std::set<RobotId>& beacons) const {
  if (beacons.size() < kLeastBeacons) return false;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const RobotId beacon : beacons) {
    const Eigen::Vector3d d =
        belief_.robots.at(dark).motion.p_F - belief_.robots.at(beacon).motion.p_F;
    spread += d * d.transpose() / d.squaredNorm();
    if (!(belief_.position_covariance(dark, beacon).trace() < kMostDoubt * kMostDoubt))
      return false;
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues()(0) >= kLeastSpread;
}

}  // namespace crepes
