#include "estimator/swarm/neighbor_track.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numbers>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr double kMaxSigma = 1.0;                                      // m
constexpr double kMaxAttitudeSigma = 20.0 * std::numbers::pi / 180.0;  // rad

// A camera that has not shown the neighbor for so long gives way to another of the same robot.
constexpr Duration kHandover = std::chrono::milliseconds{100};

constexpr int kEnough = 10;            // refusals in a row, to mean something
constexpr double kLostDistance = 1.0;  // m

double largest_sigma(const Eigen::Matrix3d& covariance) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

template <class First>
std::variant<NeighborFilter, PaperFilter> make_filter(Timestamp stamp, const First& first,
                                                      const FilterSettings& settings) {
  if (settings.profile == Profile::kPaper) return PaperFilter(stamp, first, settings.noise);
  return NeighborFilter(stamp, first, settings.noise, settings.priors);
}

Fusion fuse_tight(NeighborFilter& filter, const Measurement& m, const PairMounting& mounting,
                  const Gates& gates) {
  switch (m.kind) {
    case MeasurementKind::kBearing:
      return filter.fuse_bearing(std::get<DirectionReading>(m.reading), mounting.p_N_M,
                                 gates.bearing);
    case MeasurementKind::kPeerBearing:
      return filter.fuse_peer_bearing(std::get<DirectionReading>(m.reading), mounting.p_B_M,
                                      gates.bearing);
    case MeasurementKind::kRange:
    case MeasurementKind::kPeerRange:
      return filter.fuse_range(std::get<RangeReading>(m.reading), mounting.p_B_U, mounting.p_N_Q,
                               gates.range);
    case MeasurementKind::kGraphPose:
      return filter.fuse_correlated_pose(std::get<GraphPose>(m.reading).T_B_N, gates.pose);
    case MeasurementKind::kRawPose:
      break;
  }
  return {.verdict = Verdict::kNoState};  // a raw pose only starts this filter
}

Fusion fuse_paper(PaperFilter& filter, const Measurement& m, const Gates& gates) {
  if (m.kind == MeasurementKind::kRawPose) {
    return filter.fuse(std::get<MutualStart>(m.reading).raw, gates.raw_pose);
  }
  CREPES_EXPECT(m.kind == MeasurementKind::kGraphPose, "the paper's filter takes poses only");
  return filter.fuse(std::get<GraphPose>(m.reading).T_B_N, gates.pose);
}

}  // namespace

bool is_certain(const Matrix6d& covariance) {
  return covariance.allFinite() && largest_sigma(covariance.topLeftCorner<3, 3>()) <= kMaxSigma &&
         largest_sigma(covariance.bottomRightCorner<3, 3>()) <= kMaxAttitudeSigma;
}

NeighborTrack::NeighborTrack(Timestamp stamp, const RawPose& first, const FilterSettings& settings)
    : filter_(make_filter(stamp, first, settings)), priors_(settings.priors) {
  last_[static_cast<std::size_t>(MeasurementKind::kRawPose)] = stamp;
}

NeighborTrack::NeighborTrack(Timestamp stamp, const GraphPose& first,
                             const FilterSettings& settings)
    : filter_(make_filter(stamp, first, settings)), priors_(settings.priors) {
  last_[static_cast<std::size_t>(MeasurementKind::kGraphPose)] = stamp;
}

NeighborTrack::NeighborTrack(Timestamp stamp, const GaussianPose& T_B_N,
                             const FilterSettings& settings)
    : filter_(NeighborFilter(stamp, T_B_N, settings.noise, settings.priors)),
      priors_(settings.priors) {}

void NeighborTrack::set_noise(const ProcessNoise& noise) {
  std::visit([&](auto& filter) { filter.set_noise(noise); }, filter_);
}

Timestamp NeighborTrack::stamp() const {
  return std::visit([](const auto& filter) { return filter.stamp(); }, filter_);
}

void NeighborTrack::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  std::visit([&](auto& filter) { filter.advance_to(to, imu_B, imu_N); }, filter_);
}

Fusion NeighborTrack::fuse(const Measurement& measurement, const PairMounting& mounting,
                           const Gates& gates) {
  auto* tight = std::get_if<NeighborFilter>(&filter_);
  // Out of view, ranges that took a detour may have led the distance astray. Nothing else would
  // bring it back: bearings of a robot at twice the distance are the same.
  if (tight != nullptr && has_lost_its_distance(measurement.kind))
    tight->forget_distance(kLostDistance, priors_);
  const bool is_bearing = std::holds_alternative<DirectionReading>(measurement.reading);
  const Fusion fusion = tight == nullptr
                            ? fuse_paper(std::get<PaperFilter>(filter_), measurement, gates)
                        : is_bearing ? fuse_bearing(*tight, measurement, mounting, gates)
                                     : fuse_tight(*tight, measurement, mounting, gates);
  const auto kind = static_cast<std::size_t>(measurement.kind);
  if (fusion.verdict == Verdict::kFused) {
    last_[kind] = measurement.stamp;
    refused_[kind] = {};
  } else if (fusion.verdict == Verdict::kGated) {
    Refusals& refused = refused_[kind];
    if (refused.count++ == 0) refused.since = measurement.stamp;
    refused.latest = measurement.stamp;
  }
  return fusion;
}

Fusion NeighborTrack::fuse_bearing(NeighborFilter& filter, const Measurement& bearing,
                                   const PairMounting& mounting, const Gates& gates) {
  const Eigen::Vector3d& camera = std::get<DirectionReading>(bearing.reading).camera;
  auto& speaking = bearing.kind == MeasurementKind::kBearing ? p_B_C_ : p_N_C_;
  Fusion fusion{.verdict = Verdict::kSkipped};
  if (!speaking || *speaking == camera) {
    fusion = fuse_tight(filter, bearing, mounting, gates);
  } else if (bearing.stamp - last(bearing.kind) > kHandover) {
    NeighborFilter asked = filter;
    asked.change_camera(bearing.kind, priors_.misalignment_rad);
    fusion = fuse_tight(asked, bearing, mounting, gates);
    if (fusion.verdict == Verdict::kFused) filter = asked;
  }
  if (fusion.verdict == Verdict::kFused) speaking = camera;
  return fusion;
}

std::size_t NeighborTrack::likeliest(std::span<const Measurement> candidates,
                                     const PairMounting& mounting) const {
  const auto* tight = std::get_if<NeighborFilter>(&filter_);
  if (candidates.size() == 1 || tight == nullptr) return 0;
  NeighborFilter asked = *tight;
  std::size_t best = 0;
  double least_nis = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Fusion fusion = fuse_tight(asked, candidates[i], mounting, Gates{});  // nothing passes
    if (fusion.verdict == Verdict::kGated && fusion.nis < least_nis) {
      least_nis = fusion.nis;
      best = i;
    }
  }
  return best;
}

std::vector<NeighborTrack::Part> NeighborTrack::split() const {
  const auto* tight = std::get_if<NeighborFilter>(&filter_);
  if (tight == nullptr) return {{*this}};
  std::vector<Part> parts;
  for (const NeighborFilter::Part& part : tight->split()) {
    parts.push_back({*this, part.log_weight});
    parts.back().track.filter_ = part.filter;
  }
  return parts;
}

RelativeMotion NeighborTrack::motion() const {
  return std::visit([](const auto& filter) { return filter.motion(); }, filter_);
}

GaussianPose NeighborTrack::pose() const {
  return std::visit(
      [](const auto& filter) {
        return GaussianPose{filter.motion().T_B_N, filter.pose_covariance()};
      },
      filter_);
}

std::optional<CalibrationRecord> NeighborTrack::calibration() const {
  const auto* tight = std::get_if<NeighborFilter>(&filter_);
  if (tight == nullptr) return std::nullopt;
  const NominalState& x = tight->state();
  using States = Eigen::Matrix<double, 19, 1>;
  States value;
  value << x.bias_B.gyro_radps, x.bias_B.accel_mps2, x.bias_N.gyro_radps, x.bias_N.accel_mps2,
      x.range_bias_m, x.misalignment_B, x.misalignment_N;
  const ErrorState::Vector variance = tight->covariance().diagonal();
  States sigma;
  sigma << variance.segment<12>(ErrorState::kGyroB).cwiseSqrt(),
      variance.segment<7>(ErrorState::kRangeBias).cwiseSqrt();
  CalibrationRecord record;
  record.stamp = tight->stamp();
  States::Map(record.value.data()) = value;
  States::Map(record.sigma.data()) = sigma;
  return record;
}

Timestamp NeighborTrack::last_sighting() const {
  return std::max({last(MeasurementKind::kBearing), last(MeasurementKind::kPeerBearing),
                   last(MeasurementKind::kRawPose)});
}

bool NeighborTrack::has_lost_its_distance(MeasurementKind kind) const {
  if (kind != MeasurementKind::kRange && kind != MeasurementKind::kPeerRange) return false;
  const Refusals& refused = refused_[static_cast<std::size_t>(kind)];
  const auto fits = [this](MeasurementKind other) { return last(other) > stamp() - kPatience; };
  return refused.count >= kEnough && refused.latest - refused.since >= 2 * kPatience &&
         fits(MeasurementKind::kBearing) && fits(MeasurementKind::kPeerBearing) &&
         !fits(MeasurementKind::kRange) && !fits(MeasurementKind::kPeerRange);
}

bool NeighborTrack::has_lost_its_way() const {
  const auto is_astray = [this](MeasurementKind kind) {
    const Refusals& refused = refused_[static_cast<std::size_t>(kind)];
    return refused.count >= kEnough && refused.latest - refused.since >= kPatience;
  };
  return is_astray(MeasurementKind::kBearing) || is_astray(MeasurementKind::kPeerBearing) ||
         is_astray(MeasurementKind::kRawPose);
}

}  // namespace crepes
