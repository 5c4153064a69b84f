#include "estimator/swarm/observation_buffer.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "estimator/core/quantile.hpp"
#include "estimator/relative/range_measurement.hpp"

namespace crepes {
namespace {

constexpr Duration kKept = std::chrono::milliseconds{500};
constexpr Duration kBearingReach = std::chrono::milliseconds{20};  // two dark slots of a code
constexpr Duration kRangeReach = std::chrono::milliseconds{60};
constexpr Duration kOutOfSight = std::chrono::milliseconds{250};
// Sigma of what one error in twenty adds. Of LinkTrack's ranges 5 % are off by more than 0.39 m and
// 1 % by more than 0.73 m; an exponential tail through both.
constexpr double kOutlierSigma = 0.14;  // m
// How fast the line of sight may turn because robots pass each other. The gyroscope does not
// measure this.
constexpr double kLineRate = 0.3;  // rad/s
// Errors of the mounting, which do not average out. They also keep the covariance of z regular:
// p_B_N and p_N_B contain the same distance.
constexpr double kMountingSigma = 0.01;   // m
constexpr double kAttitudeSigma = 0.002;  // rad

// Bearings confirm each other within this time and angle, after compensation of own rotation: two,
// or three on a line.
constexpr Duration kConfirmationTime = std::chrono::milliseconds{100};
// Where the air is short, a report brings one bearing of a neighbor every 0.12 to 0.24 s.
constexpr Duration kSparseConfirmationTime = std::chrono::milliseconds{300};
constexpr double kConfirmationAngle = 0.02;  // rad; between two, kLineRate adds to it

bool is_within(Duration apart, Duration reach) { return apart > Duration{0} && apart <= reach; }

/// Another bearing, in the axes at the time of the one that it may confirm.
struct OtherBearing {
  double after_s = 0.0;
  Eigen::Vector3d u = Eigen::Vector3d::UnitX();
};

/// Whether two others lead to it at a steady rate, as where robots pass each other fast.
bool is_on_their_line(const Eigen::Vector3d& u, const std::vector<OtherBearing>& others) {
  constexpr double kMostLineRate = 3.0;  // rad/s
  const auto lead_to_it = [&](const OtherBearing& a, const OtherBearing& b) {
    const double between_s = b.after_s - a.after_s;
    const double beyond_s = std::min(std::abs(a.after_s), std::abs(b.after_s));
    if (between_s <= 0.0 || beyond_s > between_s) return false;
    const Eigen::Vector3d rate = (b.u - a.u) / between_s;
    return rate.norm() < kMostLineRate && (a.u - a.after_s * rate - u).norm() < kConfirmationAngle;
  };
  return std::ranges::any_of(others, [&](const OtherBearing& a) {
    return std::ranges::any_of(others, [&](const OtherBearing& b) { return lead_to_it(a, b); });
  });
}

bool is_confirmed(const Bearing& bearing, const std::vector<Bearing>& others, const ImuHistory& imu,
                  Duration reach = kConfirmationTime) {
  Timestamp from = bearing.stamp;  // start of `turn`; all bearings of a frame share it
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  std::vector<OtherBearing> near;
  for (const Bearing& other : others) {
    const Duration apart = std::chrono::abs(other.stamp - bearing.stamp);
    if (!is_within(apart, reach)) continue;
    if (other.stamp != std::exchange(from, other.stamp))
      turn = imu.rotation(other.stamp, bearing.stamp).conjugate();
    near.push_back({to_seconds(other.stamp - bearing.stamp), turn * other.u_B});
    if ((near.back().u - bearing.u_B).norm() < kConfirmationAngle + kLineRate * to_seconds(apart))
      return true;
  }
  return is_on_their_line(bearing.u_B, near);
}

/// The same where bearings may be far apart: then the next one counts.
bool is_confirmed_by_next(const Bearing& bearing, const std::vector<Bearing>& others,
                          const ImuHistory& imu) {
  const bool is_dense = std::ranges::any_of(others, [&](const Bearing& other) {
    return is_within(std::chrono::abs(other.stamp - bearing.stamp), kConfirmationTime);
  });
  return is_confirmed(bearing, others, imu, is_dense ? kConfirmationTime : kSparseConfirmationTime);
}

}  // namespace

ObservationBuffer::ObservationBuffer(MemberConfig self, MemberConfig neighbor,
                                     double calibration_sigma_rad, double range_sigma_m)
    : self_(std::move(self)),
      neighbor_(std::move(neighbor)),
      calibration_sigma_rad_(calibration_sigma_rad),
      range_sigma_m_(range_sigma_m) {}

// Ranges from before the robots saw each other may have gone around an obstacle.
void ObservationBuffer::add_sighting(Timestamp stamp) {
  if (!sighted_ || stamp - *sighted_ > kOutOfSight) ranges_.drop_before(stamp);
  sighted_ = std::max(sighted_.value_or(stamp), stamp);
}

void ObservationBuffer::add_own_bearing(const Bearing& bearing) {
  add_sighting(bearing.stamp);
  own_.add(bearing);
  own_.drop_before(bearing.stamp - kKept);
}

void ObservationBuffer::add_peer_bearing(const Bearing& bearing) {
  add_sighting(bearing.stamp);
  peer_.add(bearing);
  peer_.drop_before(bearing.stamp - kKept);
}

void ObservationBuffer::add_range(Timestamp stamp, double range_m) {
  ranges_.add({stamp, range_m});
  ranges_.drop_before(stamp - kKept);
}

// The confirmed bearings of the frame nearest to `t`, turned to `t`.
std::vector<Bearing> ObservationBuffer::own_at(Timestamp t, const ImuHistory& imu) const {
  const auto distance = [t](const Bearing& bearing) { return std::chrono::abs(bearing.stamp - t); };
  std::vector<Bearing> nearest;
  for (const Bearing& bearing : own_.all()) {
    if (distance(bearing) > kBearingReach || !is_confirmed(bearing, own_.all(), imu)) continue;
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

// The median of both modules' ranges around `t`: robust against an outlier, unless it is alone.
std::optional<RangeReading> ObservationBuffer::range_at(Timestamp t) const {
  std::vector<double> near;
  for (const StampedRange& range : ranges_.all()) {
    if (std::chrono::abs(range.stamp - t) <= kRangeReach) near.push_back(range.range_m);
  }
  if (near.empty()) return std::nullopt;
  const double sigma_m =
      near.size() > 1 ? range_sigma_m_ : std::hypot(range_sigma_m_, kOutlierSigma);
  return RangeReading{upper_median(near), sigma_m};
}

/// Between the antennas, whose places relative to camera and ring are not known before the pose.
std::optional<RangeReading> ObservationBuffer::range_by_ring(const Bearing& bearing,
                                                             const MemberConfig& seer,
                                                             const MemberConfig& seen) {
  if (bearing.distance_m <= 0.0) return std::nullopt;
  const double arms_m =
      (seer.p_body_uwb - bearing.p_B_C).norm() + (seen.p_body_uwb - seen.p_body_led).norm();
  const double scale_m = kRingScaleSigma * bearing.distance_m;
  return RangeReading{bearing.distance_m, std::hypot(bearing.distance_sigma_m, scale_m, arms_m)};
}

Sighting ObservationBuffer::sighting(const Bearing& bearing, const Tilt& tilt,
                                     const MemberConfig& member) const {
  return {.u = bearing.u_B,
          .up = tilt.up_B,
          .mounting = {bearing.p_B_C, member.p_body_led, member.p_body_uwb},
          .bearing_sigma_rad = std::hypot(bearing.sigma_rad, calibration_sigma_rad_),
          .tilt_sigma_rad = tilt.sigma_rad};
}

MutualInitializations ObservationBuffer::mutual_initializations(const Bearing& peer_bearing,
                                                                const RobotState& self,
                                                                const RobotState& neighbor) const {
  const Timestamp t = peer_bearing.stamp;
  const auto tilt_B = self.tilt_at(t);
  const auto tilt_N = neighbor.tilt_at(t);
  if (!tilt_B || !tilt_N) return NoPoseReason::kTiltUnknown;
  if (!is_confirmed_by_next(peer_bearing, peer_.all(), neighbor.imu))
    return NoPoseReason::kDoesNotSeeUs;
  const std::vector<Bearing> own = own_at(t, self.imu);
  if (own.empty()) return NoPoseReason::kNotSeen;
  const auto measured = range_at(t);

  std::vector<MutualInitialization> found;
  NoPoseReason reason = NoPoseReason::kNone;
  for (const Bearing& bearing : own) {
    const auto range = measured ? measured : range_by_ring(bearing, self_, neighbor_);
    if (!range) {
      reason = NoPoseReason::kNoRange;
      continue;
    }
    auto result = compute_raw_pose({.B = sighting(bearing, *tilt_B, self_),
                                    .N = sighting(peer_bearing, *tilt_N, neighbor_),
                                    .range_m = range->range_m,
                                    .range_sigma_m = range->sigma_m});
    if (auto* raw = std::get_if<RawPose>(&result)) {
      raw->covariance.diagonal().head<6>().array() += kMountingSigma * kMountingSigma;
      raw->covariance.diagonal().tail<3>().array() += kAttitudeSigma * kAttitudeSigma;
      found.push_back({*raw,
                       {bearing.u_B, bearing.p_B_C, bearing.sigma_rad},
                       {peer_bearing.u_B, peer_bearing.p_B_C, peer_bearing.sigma_rad}});
    } else {
      reason = std::get<NoPoseReason>(result);
    }
  }
  if (found.empty()) return reason;
  return found;
}

std::optional<Measurement> ObservationBuffer::one_way_initialization(
    FilterAxes axes, const RobotState& self, const RobotState& neighbor) const {
  constexpr int kHeadings = 24;
  const bool we_see = axes == FilterAxes::kOurs;
  const MemberConfig& seer = we_see ? self_ : neighbor_;
  const MemberConfig& seen = we_see ? neighbor_ : self_;
  const std::vector<Bearing>& bearings = we_see ? own_.all() : peer_.all();
  // A range may arrive later than the picture of its instant.
  std::optional<RangeReading> range;
  const auto newest = std::find_if(bearings.rbegin(), bearings.rend(), [&](const Bearing& bearing) {
    range = range_at(bearing.stamp);
    if (!range) range = range_by_ring(bearing, seer, seen);
    return range.has_value();
  });
  if (newest == bearings.rend()) return std::nullopt;
  const auto tilt_B = self.tilt_at(newest->stamp);
  const auto tilt_N = neighbor.tilt_at(newest->stamp);
  if (!tilt_B || !tilt_N) return std::nullopt;
  // Only now: without a tilt there may be no inertial sample either.
  if (we_see ? !is_confirmed(*newest, bearings, self.imu)
             : !is_confirmed_by_next(*newest, bearings, neighbor.imu))
    return std::nullopt;
  auto poses = poses_by_heading(sighting(*newest, we_see ? *tilt_B : *tilt_N, seer),
                                sighting({}, we_see ? *tilt_N : *tilt_B, seen), range->range_m,
                                range->sigma_m, kHeadings);
  if (poses.empty()) return std::nullopt;
  return Measurement{
      newest->stamp, MeasurementKind::kRawPose,
      OneWayInitialization{std::move(poses), axes, (we_see ? tilt_N : tilt_B)->up_B}};
}

}  // namespace crepes
