#include "estimator/swarm/hypotheses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

namespace crepes {
namespace {

constexpr double kMemory = 0.5;  // s, of the scores
// Of each direction; a few bearings' worth: a chance agreement brings one or two.
constexpr double kConfirmed = 25.0;
constexpr double kMargin = 10.0;  // between rivals
// Rivals may come as long after the leader, and have as long to win.
constexpr Duration kProbation = std::chrono::seconds{1};
constexpr std::size_t kMaxStarts = 8;
constexpr double kLeadersShare = 1000.0;  // of a budget; what rivals leave

std::array<Measurement, 2> bearings_of(Timestamp stamp, const MutualStart& start) {
  return {Measurement{stamp, MeasurementKind::kBearing, start.bearing},
          Measurement{stamp, MeasurementKind::kPeerBearing, start.peer_bearing}};
}

constexpr auto kIsWorse = [](const auto& a, const auto& b) {
  return std::tuple(a.confirmed, !a.one_way, a.score()) <
         std::tuple(b.confirmed, !b.one_way, b.score());
};

}  // namespace

bool CorrectionBudget::allows(Timestamp now, double reserve) {
  constexpr double kBurst = 8000.0;
  constexpr double kPerSecond = 1000.0;
  if (now > now_) left_ = std::min(kBurst, left_ + kPerSecond * to_seconds(now - now_));
  now_ = std::max(now_, now);
  return left_ > reserve;
}

void Hypotheses::reconfigure(const FilterSettings& settings) {
  if (settings.profile != settings_.profile) clear();
  settings_ = settings;
  for (Start& start : starts_) start.sum.set_noise(settings.noise);
}

bool Hypotheses::wants_start(Timestamp now) const {
  if (empty()) return true;
  const Start& leader = starts_.front();
  const NeighborTrack& track = leader.sum.heaviest();
  const bool on_trial = !leader.confirmed || now - leader.born < kProbation + settings_.lag;
  return (on_trial && settings_.profile == Profile::kTight) || leader.one_way ||
         !track.is_certain() || track.has_lost_its_way() ||
         now - track.last_sighting() > kPatience + settings_.lag;
}

bool Hypotheses::is_explained(Timestamp stamp, const MutualStart& first) const {
  const auto readings = bearings_of(stamp, first);
  return std::any_of(starts_.begin(), starts_.end(), [&](const Start& start) {
    NeighborTrack asked = start.sum.heaviest();
    const auto fits = [&](const Measurement& reading) {
      return asked.fuse(reading, mounting_, settings_.gates).verdict == Verdict::kFused;
    };
    return !start.one_way && fits(readings[0]) && fits(readings[1]);
  });
}

Hypotheses::Start Hypotheses::make(GaussianSum sum) {
  const Timestamp born = sum.heaviest().stamp();
  return {.sum = std::move(sum), .born = born, .generation = ++generations_};
}

bool Hypotheses::start(Timestamp stamp, const MutualStart& first) {
  NeighborTrack track(stamp, first.raw, settings_);
  if (settings_.profile == Profile::kPaper) {
    clear();
    starts_.push_back(make(GaussianSum(track)));
    starts_.back().confirmed = true;
    return true;
  }
  if (is_explained(stamp, first)) return false;
  std::array<double, 2> scores{};
  const auto readings = bearings_of(stamp, first);
  for (std::size_t i = 0; i < 2; ++i) {
    const Fusion fusion = track.fuse(readings[i], mounting_, settings_.gates);
    if (fusion.verdict != Verdict::kFused) return false;
    scores[i] = score_of(fusion, readings[i].kind);
  }
  if (starts_.size() >= kMaxStarts) {
    const auto worst = std::min_element(starts_.begin() + 1, starts_.end(), kIsWorse);
    if (worst->confirmed || worst->score() >= scores[0] + scores[1]) return false;
    starts_.erase(worst);
  }
  starts_.push_back(make(GaussianSum(track)));
  for (std::size_t i = 0; i < 2; ++i) starts_.back().count(readings[i].kind, scores[i]);
  return true;
}

bool Hypotheses::start(Timestamp stamp, const OneWayStart& first) {
  if (!empty()) return false;
  std::vector<NeighborTrack> parts;
  for (const GaussianPose& T_B_N : first.T_B_N) parts.emplace_back(stamp, T_B_N, settings_);
  starts_.push_back(make(GaussianSum(std::move(parts))));
  starts_.back().one_way = true;
  return true;
}

bool Hypotheses::start(Timestamp stamp, const GraphPose& first) {
  clear();
  starts_.push_back(make(GaussianSum(NeighborTrack(stamp, first, settings_))));
  starts_.back().confirmed = true;
  return true;
}

void Hypotheses::Start::count(MeasurementKind kind, double score) {
  if (kind == MeasurementKind::kBearing) seeing += score;
  if (kind == MeasurementKind::kPeerBearing) seen += score;
  const double believed = one_way ? std::max(seeing, seen) : std::min(seeing, seen);
  confirmed = confirmed || believed >= kConfirmed;
}

bool Hypotheses::has_time_for(std::size_t raw_poses, Timestamp now) {
  CorrectionBudget& time = budget(MeasurementKind::kRawPose);
  if (!time.allows(now)) return false;
  time.spend(raw_poses * starts_.size());
  return true;
}

void Hypotheses::Start::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  const Timestamp from = sum.heaviest().stamp();
  if (to <= from) return;
  sum.advance_to(to, imu_B, imu_N);
  const double keep = std::exp(-to_seconds(to - from) / kMemory);
  seeing *= keep;
  seen *= keep;
}

void Hypotheses::advance_to(Timestamp to, const ImuHistory& imu_B, const ImuHistory& imu_N) {
  for (Start& start : starts_) start.advance_to(to, imu_B, imu_N);
}

Association Hypotheses::fuse(std::span<const Measurement> candidates, const ImuHistory& imu_B,
                             const ImuHistory& imu_N) {
  const Timestamp stamp = candidates.front().stamp;
  const MeasurementKind kind = candidates.front().kind;
  CorrectionBudget& time = budget(kind);
  Association led{.fusion{.verdict = Verdict::kSkipped}};
  for (Start& start : starts_) {
    const bool leads = &start == &starts_.front();
    if (!time.allows(stamp, leads ? 0.0 : kLeadersShare)) break;
    time.spend(start.sum.size());
    start.advance_to(stamp, imu_B, imu_N);
    const Association association = start.sum.fuse(candidates, mounting_, settings_.gates);
    start.count(kind, association.score);
    if (leads) led = association;
  }
  return led;
}

void Hypotheses::settle() {
  if (empty()) return;
  for (Start& start : starts_) start.sum.prune();

  const auto best = std::max_element(starts_.begin(), starts_.end(), kIsWorse);
  const Start& leader = starts_.front();
  const bool is_mutual_for_one_way = leader.one_way && !best->one_way;
  const bool is_better = best->score() > leader.score() + kMargin || is_mutual_for_one_way;
  if (!leader.confirmed || (best->confirmed && is_better)) std::swap(starts_.front(), *best);

  const Timestamp now = stamp();
  const auto is_tried = [now](const Start& start) { return now - start.born > kProbation; };
  const auto has_lost = [&](const Start& start) {
    return (!leader.one_way && leader.sum.is_like(start.sum)) ||
           (is_tried(start) && (!start.confirmed || start.score() < leader.score() - kMargin));
  };
  starts_.erase(std::remove_if(starts_.begin() + 1, starts_.end(), has_lost), starts_.end());
  if (!leader.confirmed && is_tried(leader)) clear();
}

bool Hypotheses::is_settled() const {
  if (empty() || !starts_.front().confirmed) return false;
  const double margin = starts_.front().score() - kMargin;
  return std::none_of(starts_.begin() + 1, starts_.end(), [margin](const Start& start) {
    return start.confirmed && start.score() > margin;
  });
}

}  // namespace crepes
