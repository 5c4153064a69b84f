#include "tests/study/study.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/ctl/score/pair_score.hpp"
#include "daemon/ctl/text_table.hpp"
#include "estimator/core/constants.hpp"
#include "tests/study/replay_scores.hpp"

namespace crepes::study {
namespace {

void append(std::vector<double>& all, const std::vector<double>& more) {
  all.insert(all.end(), more.begin(), more.end());
}

Ratio ratio_of(const Quality& quality, const PairBound& bound) {
  return {quality.position_rmse_m / bound.position_rms_m,
          quality.rotation_rmse_rad / bound.rotation_rms_rad};
}

PairBound pooled_bound(const std::vector<Trial>& trials, PairBound Trial::*bound) {
  const auto n = static_cast<double>(trials.size());
  PairBound all;
  for (const Trial& trial : trials) {
    const PairBound& one = trial.*bound;
    all.position_rms_m += one.position_rms_m * one.position_rms_m / n;
    all.rotation_rms_rad += one.rotation_rms_rad * one.rotation_rms_rad / n;
  }
  all.position_rms_m = std::sqrt(all.position_rms_m);
  all.rotation_rms_rad = std::sqrt(all.rotation_rms_rad);
  return all;
}

/// Root mean squares of errors, the median of medians, the worst availability, all divergences.
Quality pooled_quality(const std::vector<Trial>& trials, Quality Trial::*profile) {
  const auto n = static_cast<double>(trials.size());
  Quality all{.worst_availability = 1.0};
  std::vector<double> nees;
  for (const Trial& trial : trials) {
    const Quality& one = trial.*profile;
    all.position_rmse_m += one.position_rmse_m * one.position_rmse_m / n;
    all.rotation_rmse_rad += one.rotation_rmse_rad * one.rotation_rmse_rad / n;
    all.share_within_95 += one.share_within_95 / n;
    all.worst_availability = std::min(all.worst_availability, one.worst_availability);
    all.divergences += one.divergences;
    nees.push_back(one.median_nees);
  }
  all.position_rmse_m = std::sqrt(all.position_rmse_m);
  all.rotation_rmse_rad = std::sqrt(all.rotation_rmse_rad);
  all.median_nees = median_of(std::move(nees));
  return all;
}

Trial pooled(const std::vector<Trial>& trials) {
  return {.name = "all " + std::to_string(trials.size()),
          .bound = pooled_bound(trials, &Trial::bound),
          .scaled_bound = pooled_bound(trials, &Trial::scaled_bound),
          .tight = pooled_quality(trials, &Trial::tight),
          .paper = pooled_quality(trials, &Trial::paper)};
}

}  // namespace

PairBound swarm_bound(const Swarm& swarm, const SensorPriors& priors, double after_s) {
  const std::vector<OrderedPair> pairs = pairs_of(swarm);
  const auto n = static_cast<double>(pairs.size());
  PairBound all;
  for (const auto& [observer, neighbor] : pairs) {
    const PairBound one = pair_bound(swarm, observer, neighbor, priors, after_s);
    all.position_rms_m += one.position_rms_m * one.position_rms_m / n;
    all.rotation_rms_rad += one.rotation_rms_rad * one.rotation_rms_rad / n;
    all.position_median_m += one.position_median_m / n;
    all.rotation_median_rad += one.rotation_median_rad / n;
  }
  all.position_rms_m = std::sqrt(all.position_rms_m);
  all.rotation_rms_rad = std::sqrt(all.rotation_rms_rad);
  return all;
}

Result<Quality> replay_quality(const Swarm& swarm, Profile profile, double after_s) {
  ReplayOptions options;
  options.profile = profile;
  options.graph = false;
  const auto scores = replay_scores(swarm, options, after_s);
  if (!scores) return tl::unexpected(scores.error());

  Quality quality;
  quality.worst_availability = 1.0;
  std::vector<double> position_errors;
  std::vector<double> rotation_errors;
  std::vector<double> nees;
  for (const auto& [pair, score] : *scores) {
    append(position_errors, score.position_errors_m);
    append(rotation_errors, score.rotation_errors_rad);
    append(nees, score.nees);
    quality.worst_availability = std::min(quality.worst_availability, score.availability);
    quality.divergences += score.divergences;
  }
  quality.position_rmse_m = statistics_of(std::move(position_errors)).rmse;
  quality.rotation_rmse_rad = statistics_of(std::move(rotation_errors)).rmse;
  quality.share_within_95 = share_within(nees, kNees95);
  quality.median_nees = median_of(std::move(nees));
  return quality;
}

Result<Trial> run_trial(const Swarm& swarm, double after_s) {
  Trial trial{.name = swarm.dataset.manifest.scenario,
              .bound = swarm_bound(swarm, {}, after_s),
              .scaled_bound = swarm_bound(swarm, kScaledPriors, after_s),
              .tight = {},
              .paper = {}};
  for (auto [quality, profile] :
       {std::pair(&trial.tight, Profile::kTight), {&trial.paper, Profile::kPaper}}) {
    const auto reached = replay_quality(swarm, profile, after_s);
    if (!reached) return tl::unexpected(reached.error());
    *quality = *reached;
  }
  return trial;
}

Ratio pooled_ratio(const std::vector<Trial>& trials, Quality Trial::*profile,
                   PairBound Trial::*bound) {
  Ratio sum;
  for (const Trial& trial : trials) {
    const Ratio ratio = ratio_of(trial.*profile, trial.*bound);
    sum.position += ratio.position * ratio.position;
    sum.rotation += ratio.rotation * ratio.rotation;
  }
  const auto n = static_cast<double>(trials.size());
  return {std::sqrt(sum.position / n), std::sqrt(sum.rotation / n)};
}

std::string table_of(const std::vector<Trial>& trials) {
  std::vector<std::vector<std::string>> rows{
      {"set", "bound m", "deg", "tight m", "deg", "ratio m", "deg", "of scaled m", "deg", "nees",
       "in 95 %", "avail %", "diverged", "paper m", "deg", "ratio m", "deg", "nees", "diverged"}};
  const auto add = [&rows](const Trial& trial, const Ratio& tight, const Ratio& scaled,
                           const Ratio& paper) {
    const Quality& t = trial.tight;
    const Quality& p = trial.paper;
    rows.push_back({trial.name, fixed(trial.bound.position_rms_m, 4),
                    fixed(kDegPerRad * trial.bound.rotation_rms_rad, 3),
                    fixed(t.position_rmse_m, 4), fixed(kDegPerRad * t.rotation_rmse_rad, 3),
                    fixed(tight.position, 2), fixed(tight.rotation, 2), fixed(scaled.position, 2),
                    fixed(scaled.rotation, 2), fixed(t.median_nees, 2),
                    fixed(100.0 * t.share_within_95, 1), fixed(100.0 * t.worst_availability, 1),
                    std::to_string(t.divergences), fixed(p.position_rmse_m, 4),
                    fixed(kDegPerRad * p.rotation_rmse_rad, 3), fixed(paper.position, 2),
                    fixed(paper.rotation, 2), fixed(p.median_nees, 2),
                    std::to_string(p.divergences)});
  };
  for (const Trial& trial : trials)
    add(trial, ratio_of(trial.tight, trial.bound), ratio_of(trial.tight, trial.scaled_bound),
        ratio_of(trial.paper, trial.bound));
  add(pooled(trials), pooled_ratio(trials, &Trial::tight),
      pooled_ratio(trials, &Trial::tight, &Trial::scaled_bound),
      pooled_ratio(trials, &Trial::paper));
  return text_table(rows);
}

}  // namespace crepes::study
