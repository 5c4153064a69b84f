#include "estimator/swarm/hypothesis_set.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kScoreMemory = 0.5;  // s
// Score of each direction that confirms: that of a few bearings. Clutter may agree once or twice.
constexpr double kConfirmed = 25.0;
constexpr double kMargin = 10.0;  // between rivals
// A new leader accepts rivals for so long, and a rival has as long to win.
constexpr Duration kProbation = std::chrono::seconds{1};
constexpr std::size_t kMaxHypotheses = 8;
constexpr double kLeadersShare = 1000.0;  // of a budget, which rivals do not spend

std::array<Measurement, 2> bearings_of(Timestamp stamp, const MutualInitialization& first) {
  return {Measurement{stamp, MeasurementKind::kBearing, first.bearing},
          Measurement{stamp, MeasurementKind::kPeerBearing, first.peer_bearing}};
}

// A filter that became uncertain out of sight knows less than one mutual sighting says. Its error
// is too large for one linearization, so the first bearing could make it certain of a wrong pose.
bool is_lost(const NeighborTrack& track) {
  return !track.is_certain() && track.stamp() - track.last_sighting() > kDivergenceTime;
}

// One that takes another robot for its neighbor seldom does so for longer.
constexpr Duration kMistake = std::chrono::milliseconds{800};

// So long two are compared before one that is disputed can lose to a younger one.
constexpr Duration kTogether = std::chrono::milliseconds{500};

// A mirror image is as bright as its robot, but it tilts the pose. Tilts err by less than they say.
constexpr double kTilted = 4.0;      // NIS
constexpr double kTiltScore = 50.0;  // by NIS

// Scores forget. This part of a steady one is gathered within a hypothesis' age.
double gathered(Duration age) { return 1.0 - std::exp(-to_seconds(age) / kScoreMemory); }

}  // namespace

void HypothesisSet::reconfigure(const FilterSettings& settings) {
  if (settings.traits != settings_.traits) clear();
  settings_ = settings;
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.sum.set_noise(settings.noise);
}

bool HypothesisSet::accepts_raw_pose(Timestamp now) const {
  if (empty()) return true;
  const Hypothesis& leader = hypotheses_.front();
  const NeighborTrack& track = leader.sum.heaviest();
  const bool on_probation = !leader.confirmed || now - leader.born < kProbation + settings_.lag;
  return ((on_probation || leader.is_disputed()) && settings_.traits.hypotheses_compete) ||
         leader.one_way || !track.is_certain() || track.is_diverged() ||
         now - track.last_sighting() > kDivergenceTime + settings_.lag;
}

bool HypothesisSet::is_explained(Timestamp stamp, const MutualInitialization& first) const {
  const auto readings = bearings_of(stamp, first);
  return std::any_of(hypotheses_.begin(), hypotheses_.end(), [&](const Hypothesis& hypothesis) {
    NeighborTrack trial = hypothesis.sum.heaviest();
    const auto fits = [&](const Measurement& reading) {
      return trial.fuse(reading, mounting_, settings_.gates).verdict == Verdict::kFused;
    };
    return !hypothesis.one_way && fits(readings[0]) && fits(readings[1]);
  });
}

HypothesisSet::Hypothesis HypothesisSet::make(GaussianSum sum) {
  const Timestamp born = sum.heaviest().stamp();
  return {.sum = std::move(sum), .born = born, .generation = ++generations_};
}

bool HypothesisSet::initialize(Timestamp stamp, const MutualInitialization& first) {
  NeighborTrack track(stamp, first.raw, settings_);
  if (!settings_.traits.hypotheses_compete) {
    clear();
    hypotheses_.push_back(make(GaussianSum(track)));
    hypotheses_.back().confirmed = true;
    return true;
  }
  if (is_explained(stamp, first)) return false;
  std::array<double, 2> scores{};
  const auto readings = bearings_of(stamp, first);
  for (std::size_t i = 0; i < 2; ++i) {
    const Fusion fusion = track.fuse(readings[i], mounting_, settings_.gates);
    if (fusion.verdict != Verdict::kFused) return false;
    scores[i] = log_likelihood_ratio(fusion, readings[i].kind);
  }
  if (hypotheses_.size() >= kMaxHypotheses) {
    const auto worst =
        std::ranges::min_element(hypotheses_.begin() + 1, hypotheses_.end(), {}, rank());
    if (worst->confirmed || worst->score() >= scores[0] + scores[1]) return false;
    hypotheses_.erase(worst);
  }
  hypotheses_.push_back(make(GaussianSum(track)));
  for (std::size_t i = 0; i < 2; ++i) hypotheses_.back().add_score(readings[i].kind, scores[i]);
  return true;
}

bool HypothesisSet::initialize(Timestamp stamp, const OneWayInitialization& first) {
  const bool is_heading_known = !first.up_seen;
  if (!empty() && !(is_heading_known && has_open_heading())) return false;
  clear();
  std::vector<NeighborTrack> parts;
  for (const GaussianPose& pose : first.T_seer_seen)
    parts.emplace_back(stamp, pose, first, settings_);
  hypotheses_.push_back(
      make(is_heading_known ? GaussianSum(parts.front()) : GaussianSum(std::move(parts))));
  hypotheses_.back().one_way = true;
  return true;
}

bool HypothesisSet::initialize(Timestamp stamp, const GraphPose& first) {
  clear();
  hypotheses_.push_back(make(GaussianSum(NeighborTrack(stamp, first, settings_))));
  hypotheses_.back().confirmed = true;
  return true;
}

void HypothesisSet::Hypothesis::add_score(MeasurementKind kind, double log_likelihood_ratio) {
  if (kind == MeasurementKind::kBearing) bearing_score += log_likelihood_ratio;
  if (kind == MeasurementKind::kPeerBearing) peer_bearing_score += log_likelihood_ratio;
  const double support = one_way ? std::max(bearing_score, peer_bearing_score)
                                 : std::min(bearing_score, peer_bearing_score);
  confirmed = confirmed || support >= kConfirmed;
}

void HypothesisSet::Hypothesis::note_beside(MeasurementKind kind, bool has_one) {
  constexpr double kShare = 0.05;  // of one reading
  if (kind != MeasurementKind::kBearing && kind != MeasurementKind::kPeerBearing) return;
  double& share = kind == MeasurementKind::kBearing ? bearings_beside : peer_bearings_beside;
  share += kShare * ((has_one ? 1.0 : 0.0) - share);
}

bool HypothesisSet::Hypothesis::is_disputed() const {
  constexpr double kDisputed = 0.3;
  return std::max(bearings_beside, peer_bearings_beside) > kDisputed && tilt_nis > kTilted;
}

bool HypothesisSet::has_budget_for(std::size_t raw_poses, Timestamp now) {
  CorrectionBudget& corrections = budget(MeasurementKind::kRawPose);
  if (!corrections.allows(now)) return false;
  corrections.spend(raw_poses * hypotheses_.size());
  return true;
}

void HypothesisSet::Hypothesis::advance_to(Timestamp to, const ImuHistory& imu_B,
                                           const ImuHistory& imu_N) {
  const Timestamp from = sum.heaviest().stamp();
  if (to <= from) return;
  sum.advance_to(to, imu_B, imu_N);
  const double kept = std::exp(-to_seconds(to - from) / kScoreMemory);
  bearing_score *= kept;
  peer_bearing_score *= kept;
}

void HypothesisSet::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.advance_to(to, imu_B, imu_N);
}

Association HypothesisSet::fuse(std::span<const Measurement> candidates, const ImuHistory& imu_B,
                                const ImuHistory& imu_N) {
  const Timestamp stamp = candidates.front().stamp;
  const MeasurementKind kind = candidates.front().kind;
  // After a pause, readings of seconds come at once, and nothing is pruned between them.
  if (!empty() && stamp - this->stamp() > kDivergenceTime) {
    advance_to(stamp, imu_B, imu_N);
    if (must_start_anew()) clear();
  }
  if (empty()) return {.fusion{.verdict = Verdict::kNoState}};
  CorrectionBudget& corrections = budget(kind);
  Association of_leader{.fusion{.verdict = Verdict::kSkipped}};
  for (Hypothesis& hypothesis : hypotheses_) {
    const bool leads = &hypothesis == &hypotheses_.front();
    if (!corrections.allows(stamp, leads ? 0.0 : kLeadersShare)) break;
    corrections.spend(hypothesis.sum.size());
    hypothesis.advance_to(stamp, imu_B, imu_N);
    const Association association = hypothesis.sum.fuse(candidates, mounting_, settings_.gates);
    hypothesis.add_score(kind, association.score);
    hypothesis.note_beside(kind,
                           candidates.size() > 1 || association.fusion.verdict == Verdict::kGated);
    if (leads) of_leader = association;
  }
  return of_leader;
}

void HypothesisSet::compare_tilts(const Tilt& ours, const Tilt& neighbors) {
  const double variance =
      ours.sigma_rad * ours.sigma_rad + neighbors.sigma_rad * neighbors.sigma_rad;
  for (Hypothesis& hypothesis : hypotheses_) {
    const GaussianPose pose = hypothesis.sum.heaviest().pose();
    const double angle = angle_between(pose.pose.q * neighbors.up_B, ours.up_B);
    const double of_pose = pose.covariance.bottomRightCorner<3, 3>().trace() / 3.0;
    hypothesis.tilt_nis = angle * angle / (variance + of_pose);
  }
}

void HypothesisSet::prune() {
  if (empty()) return;
  for (Hypothesis& hypothesis : hypotheses_) hypothesis.sum.prune();

  const auto best = std::ranges::max_element(hypotheses_, {}, rank());
  const auto must_give_way = [&](const Hypothesis& current) {
    const bool is_mutual_for_one_way = current.one_way && !best->one_way;
    const bool is_better = lead(*best) > kMargin || is_mutual_for_one_way;
    return !current.confirmed || (best->confirmed && is_better);
  };
  if (must_give_way(hypotheses_.front())) std::swap(hypotheses_.front(), *best);

  const Hypothesis& leader = hypotheses_.front();
  const Timestamp now = stamp();
  const auto is_past_probation = [now](const Hypothesis& hypothesis) {
    return now - hypothesis.born > kProbation;
  };
  const auto has_lost = [&](const Hypothesis& rival) {
    return (!leader.one_way && leader.sum.is_compatible_with(rival.sum)) ||
           (is_past_probation(rival) && (!rival.confirmed || lead(rival) < -kMargin));
  };
  hypotheses_.erase(std::remove_if(hypotheses_.begin() + 1, hypotheses_.end(), has_lost),
                    hypotheses_.end());
  if ((!leader.confirmed && is_past_probation(leader)) || must_start_anew()) clear();
}

bool HypothesisSet::must_start_anew() const {
  return settings_.traits.fuses_single_readings && is_lost(hypotheses_.front().sum.heaviest());
}

bool HypothesisSet::is_unambiguous() const {
  if (empty() || !hypotheses_.front().confirmed) return false;
  if (hypotheses_.front().is_disputed()) return false;
  return std::none_of(hypotheses_.begin() + 1, hypotheses_.end(),
                      [this](const Hypothesis& h) { return h.confirmed && lead(h) > -kMargin; });
}

double HypothesisSet::lead(const Hypothesis& rival) const {
  const auto score = [this](const Hypothesis& of, const Hypothesis& beside) {
    const Duration together = stamp() - beside.born;
    const bool is_doubted = of.sum.heaviest().contradicted_for() >= kMistake ||
                            (of.is_disputed() && together >= kTogether);
    return of.score() * (of.born < beside.born && is_doubted ? gathered(together) : 1.0);
  };
  const Hypothesis& leader = hypotheses_.front();
  const double by_tilt =
      leader.is_disputed() ? kTiltScore * (leader.tilt_nis - rival.tilt_nis) : 0.0;
  return score(rival, leader) - score(leader, rival) + by_tilt;
}

}  // namespace crepes
