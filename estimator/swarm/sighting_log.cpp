#include "estimator/swarm/sighting_log.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace crepes {
namespace {

constexpr Duration kKept = std::chrono::milliseconds{500};
constexpr Duration kBearingReach = std::chrono::milliseconds{20};  // two dark slots
constexpr Duration kRangeReach = std::chrono::milliseconds{60};
// What moves between two instants that the gyroscope does not show: the line of sight, as robots
// pass each other.
constexpr double kLineRate = 0.3;  // rad/s
// Raw poses lean on calibration as they find it. This much of their error never averages out, and
// keeps the covariance of z regular where p_B_N and p_N_B tell the same distance.
constexpr double kMountingSigma = 0.01;   // m
constexpr double kAttitudeSigma = 0.002;  // rad

// Sightings of one ring follow each other within this, the gyroscope's turn taken out.
constexpr Duration kAgain = std::chrono::milliseconds{100};
constexpr double kAgainReach = 0.02;  // rad, and what kLineRate adds

bool is_seen_again(const Bearing& bearing, const Recent<Bearing, 256>& log, const ImuHistory& imu) {
  Timestamp from = bearing.stamp;  // of `turn`, which all bearings of a frame share
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  return std::any_of(log.all().begin(), log.all().end(), [&](const Bearing& other) {
    const Duration apart = std::chrono::abs(other.stamp - bearing.stamp);
    if (apart == Duration{0} || apart > kAgain) return false;
    if (other.stamp != std::exchange(from, other.stamp))
      turn = imu.rotation(other.stamp, bearing.stamp).conjugate();
    return (turn * other.u_B - bearing.u_B).norm() < kAgainReach + kLineRate * to_seconds(apart);
  });
}

}  // namespace

SightingLog::SightingLog(MemberConfig self, MemberConfig neighbor, double calibration_sigma_rad,
                         double range_sigma_m)
    : self_(std::move(self)),
      neighbor_(std::move(neighbor)),
      calibration_sigma_rad_(calibration_sigma_rad),
      range_sigma_m_(range_sigma_m) {}

void SightingLog::add_own(const Bearing& bearing) {
  own_.add(bearing);
  own_.forget_before(bearing.stamp - kKept);
}

void SightingLog::add_peer(const Bearing& bearing) {
  peer_.add(bearing);
  peer_.forget_before(bearing.stamp - kKept);
}

void SightingLog::add_range(Timestamp stamp, double range_m) {
  ranges_.add({stamp, range_m});
  ranges_.forget_before(stamp - kKept);
}

// What the nearest frame showed, of what was seen more than once.
std::vector<Bearing> SightingLog::own_at(Timestamp t, const ImuHistory& imu) const {
  const auto distance = [t](const Bearing& bearing) { return std::chrono::abs(bearing.stamp - t); };
  std::vector<Bearing> nearest;
  for (const Bearing& bearing : own_.all()) {
    if (distance(bearing) > kBearingReach || !is_seen_again(bearing, own_, imu)) continue;
    if (!nearest.empty() && distance(bearing) < distance(nearest.front())) nearest.clear();
    if (nearest.empty() || bearing.stamp == nearest.front().stamp) nearest.push_back(bearing);
  }
  for (Bearing& bearing : nearest) {
    bearing.u_B = imu.rotation(bearing.stamp, t).conjugate() * bearing.u_B;
    bearing.sigma_rad = std::hypot(bearing.sigma_rad, kLineRate * to_seconds(distance(bearing)));
    bearing.stamp = t;
  }
  return nearest;
}

// The median of what both modules said around t: an outlier does not pass.
std::optional<double> SightingLog::range_at(Timestamp t) const {
  std::vector<double> near;
  for (const StampedRange& range : ranges_.all()) {
    if (std::chrono::abs(range.stamp - t) <= kRangeReach) near.push_back(range.range_m);
  }
  if (near.empty()) return std::nullopt;
  const auto middle = near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2);
  std::nth_element(near.begin(), middle, near.end());
  return *middle;
}

Sighting SightingLog::sighting(const Bearing& bearing, const Tilt& tilt,
                               const MemberConfig& member) const {
  return {.u = bearing.u_B,
          .up = tilt.up_B,
          .mounting = {bearing.p_B_C, member.p_body_led, member.p_body_uwb},
          .bearing_sigma_rad = std::hypot(bearing.sigma_rad, calibration_sigma_rad_),
          .tilt_sigma_rad = tilt.sigma_rad};
}

std::variant<std::vector<MutualStart>, NoPoseReason> SightingLog::starts(
    const Bearing& peer_bearing, const RobotState& self, const RobotState& neighbor) const {
  const Timestamp t = peer_bearing.stamp;
  const auto tilt_B = self.tilt_at(t);
  const auto tilt_N = neighbor.tilt_at(t);
  if (!tilt_B || !tilt_N) return NoPoseReason::kTiltUnknown;
  if (!is_seen_again(peer_bearing, peer_, neighbor.imu)) return NoPoseReason::kDoesNotSeeUs;
  const std::vector<Bearing> own = own_at(t, self.imu);
  if (own.empty()) return NoPoseReason::kNotSeen;
  const auto range_m = range_at(t);
  if (!range_m) return NoPoseReason::kNoRange;

  std::vector<MutualStart> starts;
  NoPoseReason reason = NoPoseReason::kNone;
  for (const Bearing& bearing : own) {
    auto result = compute_raw_pose({.B = sighting(bearing, *tilt_B, self_),
                                    .N = sighting(peer_bearing, *tilt_N, neighbor_),
                                    .range_m = *range_m,
                                    .range_sigma_m = range_sigma_m_});
    if (auto* raw = std::get_if<RawPose>(&result)) {
      raw->covariance.diagonal().head<6>().array() += kMountingSigma * kMountingSigma;
      raw->covariance.diagonal().tail<3>().array() += kAttitudeSigma * kAttitudeSigma;
      starts.push_back({*raw,
                        {bearing.u_B, bearing.p_B_C, bearing.sigma_rad},
                        {peer_bearing.u_B, peer_bearing.p_B_C, peer_bearing.sigma_rad}});
    } else {
      reason = std::get<NoPoseReason>(result);
    }
  }
  if (starts.empty()) return reason;
  return starts;
}

std::optional<Measurement> SightingLog::one_way_start(const RobotState& self,
                                                      const RobotState& neighbor) const {
  constexpr int kHeadings = 24;
  if (own_.all().empty() || !is_seen_again(own_.all().back(), own_, self.imu)) return std::nullopt;
  const Bearing& bearing = own_.all().back();
  const auto tilt_B = self.tilt_at(bearing.stamp);
  const auto tilt_N = neighbor.tilt_at(bearing.stamp);
  const auto range_m = range_at(bearing.stamp);
  if (!tilt_B || !tilt_N || !range_m) return std::nullopt;
  auto poses = poses_by_heading(sighting(bearing, *tilt_B, self_), sighting({}, *tilt_N, neighbor_),
                                *range_m, range_sigma_m_, kHeadings);
  if (poses.empty()) return std::nullopt;
  return Measurement{bearing.stamp, MeasurementKind::kRawPose, OneWayStart{std::move(poses)}};
}

}  // namespace crepes
