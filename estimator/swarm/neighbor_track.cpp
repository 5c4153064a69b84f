#include "estimator/swarm/neighbor_track.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "estimator/core/constants.hpp"
#include "estimator/core/contract.hpp"
#include "estimator/relative/arc_pose.hpp"

namespace crepes {
namespace {

constexpr double kMaxSigma = 1.0;                    // m
constexpr double kMaxAttitudeSigma = radians(20.0);  // rad

// Another camera of the same robot is used after the current one was silent for so long.
constexpr Duration kHandover = std::chrono::milliseconds{100};

constexpr int kMinGated = 10;                   // in a row; fewer may be chance
constexpr int kMinGatedRanges = 2 * kMinGated;  // by two modules
constexpr int kMinContradicting = 3;            // in a row, after the last one that fit
// Without so long a gap, false bearings among true ones are gated in a row, too.
constexpr Duration kGlimpseGap = std::chrono::milliseconds{100};
constexpr double kDistanceSigma = 1.0;  // m; after a reset, at least
// Where ranges are rare, a few decide. What makes one false, as a reflection, lasts less long.
constexpr int kMinRareRanges = 3;
constexpr double kMostOff = 4.8;  // m; beyond that, a range is more likely false after a reset, too
// So long after a sighting, a robot may be behind something, and its ranges come late. At first by
// little, and by more from range to range, which looks like motion.
constexpr Duration kHidden = std::chrono::milliseconds{150};
constexpr double kHiddenPath = 0.1;  // m, one sigma; beyond that, they contradict the filter
constexpr Duration kRareRangesTime = std::chrono::milliseconds{3500};
constexpr Duration kDoubtfulTime = std::chrono::seconds{1};  // without a range that fits

/// The index of a kind's gated run.
std::size_t run_of(MeasurementKind kind) {
  return static_cast<std::size_t>(is_range(kind) ? MeasurementKind::kRange : kind);
}

double largest_sigma(const Eigen::Matrix3d& covariance) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(2)));
}

template <class First>
std::variant<NeighborFilter, PaperFilter> make_filter(Timestamp stamp, const First& first,
                                                      const FilterSettings& settings) {
  if (!settings.traits.has_bias_states) return PaperFilter(stamp, first, settings.noise);
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
    case MeasurementKind::kRingDistance:
      return filter.fuse_ring_distance(std::get<RingReading>(m.reading), mounting.p_N_M,
                                       gates.range);
    case MeasurementKind::kGraphPose:
      return filter.fuse_correlated_pose(std::get<GraphPose>(m.reading).T_B_N, gates.pose);
    case MeasurementKind::kRawPose:
      break;
  }
  return {.verdict = Verdict::kNoState};  // a raw pose only initializes this filter
}

MeasurementKind mirrored(MeasurementKind kind) {
  switch (kind) {
    case MeasurementKind::kBearing:
      return MeasurementKind::kPeerBearing;
    case MeasurementKind::kPeerBearing:
      return MeasurementKind::kBearing;
    case MeasurementKind::kRange:
      return MeasurementKind::kPeerRange;
    case MeasurementKind::kPeerRange:
      return MeasurementKind::kRange;
    default:
      return kind;
  }
}

/// The same reading with the robots exchanged.
Measurement mirrored(Measurement m) {
  m.kind = mirrored(m.kind);
  if (auto* const graph = std::get_if<GraphPose>(&m.reading)) graph->T_B_N = inverse(graph->T_B_N);
  return m;
}

PairMounting mirrored(const PairMounting& m) { return {m.p_N_M, m.p_N_Q, m.p_B_M, m.p_B_U}; }

Fusion fuse_paper(PaperFilter& filter, const Measurement& m, const Gates& gates) {
  if (m.kind == MeasurementKind::kRawPose) {
    return filter.fuse(std::get<MutualInitialization>(m.reading).raw, gates.raw_pose);
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

NeighborTrack::NeighborTrack(Timestamp stamp, const GaussianPose& T_seer_seen,
                             const OneWayInitialization& start, const FilterSettings& settings)
    : filter_(NeighborFilter(stamp, T_seer_seen, settings.noise, settings.priors)),
      axes_(start.axes),
      priors_(settings.priors) {
  if (start.up_seen) std::get<NeighborFilter>(filter_).hold_heading(*start.up_seen);
}

void NeighborTrack::release_heading() {
  if (auto* const tight = std::get_if<NeighborFilter>(&filter_)) tight->release_heading();
}

void NeighborTrack::set_noise(const ProcessNoise& noise) {
  std::visit([&](auto& filter) { filter.set_noise(noise); }, filter_);
}

Timestamp NeighborTrack::stamp() const {
  return std::visit([](const auto& filter) { return filter.stamp(); }, filter_);
}

void NeighborTrack::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  const bool is_ours = axes_ == FilterAxes::kOurs;
  std::visit(
      [&](auto& filter) {
        filter.advance_to(to, is_ours ? imu_B : imu_N, is_ours ? imu_N : imu_B);
      },
      filter_);
}

Fusion NeighborTrack::fuse(const Measurement& measurement, const PairMounting& mounting,
                           const Gates& gates) {
  auto* tight = std::get_if<NeighborFilter>(&filter_);
  // While the robots could not see each other, reflected ranges may have corrupted the distance; or
  // ranges are rare, and the IMUs misled it. Bearings do not depend on the distance.
  if (tight != nullptr && is_range(measurement.kind) && is_range_diverged()) {
    // Where ranges are many, they reset it again until one is accepted.
    GatedRun& gated = gated_[run_of(measurement.kind)];
    const double off_m = gated.count < kMinGatedRanges ? std::abs(gated.residual) : 0.0;
    tight->reset_distance(std::max(kDistanceSigma, off_m), priors_);
    gated.used = 0;
  }
  const bool is_bearing = std::holds_alternative<DirectionReading>(measurement.reading);
  const Fusion fusion = tight == nullptr
                            ? fuse_paper(std::get<PaperFilter>(filter_), measurement, gates)
                        : is_bearing ? fuse_bearing(*tight, measurement, mounting, gates)
                                     : correct(*tight, doubted(measurement), mounting, gates);
  if (fusion.verdict == Verdict::kFused)
    last_[static_cast<std::size_t>(measurement.kind)] = measurement.stamp;
  gated_[run_of(measurement.kind)].add(measurement.stamp, fusion);
  return fusion;
}

Measurement NeighborTrack::doubted(Measurement measurement) const {
  auto* const range = std::get_if<RangeReading>(&measurement.reading);
  if (range != nullptr && measurement.stamp > last_sighting() + kHidden)
    range->shared_m = std::max(range->shared_m, kHiddenPath);
  return measurement;
}

void NeighborTrack::GatedRun::add(Timestamp stamp, const Fusion& fusion) {
  if (fusion.verdict == Verdict::kFused) {
    const int more = std::min(used + 1, kMinContradicting);
    *this = {};
    used = more;
  }
  if (fusion.verdict != Verdict::kGated) return;
  if (count++ == 0) since = stamp;
  latest = stamp;
  residual = fusion.residual[0];
}

Fusion NeighborTrack::correct(NeighborFilter& filter, const Measurement& measurement,
                              const PairMounting& mounting, const Gates& gates) const {
  if (axes_ == FilterAxes::kOurs) return fuse_tight(filter, measurement, mounting, gates);
  // A filter has no model of what the other robot's camera sees of a ring's size.
  if (measurement.kind == MeasurementKind::kRingDistance) return {.verdict = Verdict::kSkipped};
  return fuse_tight(filter, mirrored(measurement), mirrored(mounting), gates);
}

Fusion NeighborTrack::fuse_bearing(NeighborFilter& filter, const Measurement& bearing,
                                   const PairMounting& mounting, const Gates& gates) {
  const Eigen::Vector3d& camera = std::get<DirectionReading>(bearing.reading).camera;
  auto& in_use = bearing.kind == MeasurementKind::kBearing ? p_B_C_ : p_N_C_;
  Fusion fusion{.verdict = Verdict::kSkipped};
  if (!in_use || *in_use == camera) {
    fusion = correct(filter, bearing, mounting, gates);
  } else if (bearing.stamp - last(bearing.kind) > kHandover) {
    NeighborFilter trial = filter;
    trial.reset_misalignment(axes_ == FilterAxes::kOurs ? bearing.kind : mirrored(bearing.kind),
                             priors_.misalignment_rad);
    fusion = correct(trial, bearing, mounting, gates);
    if (fusion.verdict == Verdict::kFused) filter = trial;
  }
  if (fusion.verdict == Verdict::kFused) in_use = camera;
  return fusion;
}

std::size_t NeighborTrack::most_likely(std::span<const Measurement> candidates,
                                       const PairMounting& mounting) const {
  const auto* tight = std::get_if<NeighborFilter>(&filter_);
  if (candidates.size() == 1 || tight == nullptr) return 0;
  NeighborFilter trial = *tight;
  std::size_t best = 0;
  double least_nis = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Fusion fusion = correct(trial, candidates[i], mounting, Gates{});  // all gated
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
  RelativeMotion motion = std::visit([](const auto& filter) { return filter.motion(); }, filter_);
  if (axes_ == FilterAxes::kNeighbors) {
    motion.T_B_N = motion.T_B_N.inverse();
    motion.v_B_N = -(motion.T_B_N.q * motion.v_B_N);
  }
  return motion;
}

GaussianPose NeighborTrack::pose() const {
  const GaussianPose pose = std::visit(
      [](const auto& filter) {
        return GaussianPose{filter.motion().T_B_N, filter.pose_covariance()};
      },
      filter_);
  return axes_ == FilterAxes::kOurs ? pose : inverse_on_arc(pose);
}

double NeighborTrack::speed_sigma() const {
  const auto* tight = std::get_if<NeighborFilter>(&filter_);
  if (tight == nullptr) return 0.0;
  return std::sqrt(tight->covariance().diagonal().segment<3>(ErrorState::kV).maxCoeff());
}

std::optional<CalibrationRecord> NeighborTrack::calibration() const {
  const auto* tight = std::get_if<NeighborFilter>(&filter_);
  if (tight == nullptr) return std::nullopt;
  const NominalState& x = tight->state();
  const ErrorState::Vector variance = tight->covariance().diagonal();
  using R = CalibrationRecord;
  R record;
  record.stamp = tight->stamp();
  const bool is_ours = axes_ == FilterAxes::kOurs;
  const auto put = [&](R::Index index, const auto& value, int state) {
    constexpr int kSize = std::decay_t<decltype(value)>::RowsAtCompileTime;
    using Values = Eigen::Matrix<double, kSize, 1>;
    Values::Map(&record.value[index]) = value;
    Values::Map(&record.sigma[index]) = variance.segment<kSize>(state).cwiseSqrt();
  };
  put(is_ours ? R::kGyroB : R::kGyroN, x.bias_B.gyro_radps, ErrorState::kGyroB);
  put(is_ours ? R::kAccelB : R::kAccelN, x.bias_B.accel_mps2, ErrorState::kAccelB);
  put(is_ours ? R::kGyroN : R::kGyroB, x.bias_N.gyro_radps, ErrorState::kGyroN);
  put(is_ours ? R::kAccelN : R::kAccelB, x.bias_N.accel_mps2, ErrorState::kAccelN);
  put(R::kRangeBias, Eigen::Matrix<double, 1, 1>(x.range_bias_m), ErrorState::kRangeBias);
  put(is_ours ? R::kMisalignB : R::kMisalignN, x.misalignment_B, ErrorState::kMisalignB);
  put(is_ours ? R::kMisalignN : R::kMisalignB, x.misalignment_N, ErrorState::kMisalignN);
  return record;
}

Timestamp NeighborTrack::last_sighting() const {
  return std::max({last(MeasurementKind::kBearing), last(MeasurementKind::kPeerBearing),
                   last(MeasurementKind::kRawPose)});
}

bool NeighborTrack::is_range_diverged() const {
  const GatedRun& gated = gated_[run_of(MeasurementKind::kRange)];
  const auto fits = [this](MeasurementKind other) {
    return last(other) > stamp() - kDivergenceTime;
  };
  return ((gated.count >= kMinGatedRanges && gated.length() >= 2 * kDivergenceTime) ||
          (gated.count >= kMinRareRanges && gated.length() >= kRareRangesTime &&
           std::abs(gated.residual) <= kMostOff)) &&
         fits(MeasurementKind::kBearing) && fits(MeasurementKind::kPeerBearing);
}

bool NeighborTrack::is_contradicted() const {
  const Timestamp sighted = last_sighting();
  const auto is_contrary = [&](MeasurementKind kind) {
    const GatedRun& gated = gated_[run_of(kind)];
    // A pose that drifts off leaves no gap between the last bearing that fits and the first that
    // does not.
    return gated.count >= kMinContradicting &&
           (gated.since > sighted + kGlimpseGap || gated.latest >= sighted + kDivergenceTime);
  };
  const GatedRun& ranges = gated_[run_of(MeasurementKind::kRange)];
  const int enough = std::max(1, ranges.used);
  const bool are_ranges_contrary =  // old ones say nothing, if no more come
      (ranges.count >= enough || ranges.length() >= kDoubtfulTime) &&
      stamp() - ranges.latest < kRareRangesTime;
  return is_contrary(MeasurementKind::kBearing) || is_contrary(MeasurementKind::kPeerBearing) ||
         are_ranges_contrary;
}

Duration NeighborTrack::contradicted_for() const {
  const auto length = [this](MeasurementKind kind) {
    const GatedRun& gated = gated_[run_of(kind)];
    return gated.count >= kMinGated ? gated.length() : Duration{0};
  };
  return std::max({length(MeasurementKind::kBearing), length(MeasurementKind::kPeerBearing),
                   length(MeasurementKind::kRawPose)});
}

}  // namespace crepes
