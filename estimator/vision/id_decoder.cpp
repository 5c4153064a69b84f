#include "estimator/vision/id_decoder.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "estimator/vision/decoding/code_model.hpp"
#include "estimator/vision/decoding/dark_runs.hpp"
#include "estimator/vision/decoding/foreign_code.hpp"
#include "estimator/vision/decoding/id_doubt.hpp"
#include "estimator/vision/decoding/id_posterior.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"
#include "estimator/vision/decoding/rival_board.hpp"
#include "estimator/vision/decoding/sighting_prior.hpp"

namespace crepes {
namespace {

constexpr std::int64_t kWindowPeriods = 6;
constexpr Duration kMinWindow = std::chrono::milliseconds{1200};
constexpr double kDarkFrames = 6.0;    // margin of a dark run: its edges, missed frames
constexpr double kMissedFrames = 2.0;  // at the edges of a dark run
constexpr std::int64_t kPeriodsToLearn = 2;
constexpr std::int64_t kPeriodsCompared = 2;
constexpr std::int64_t kComparisonsPerPeriod = 4;

// Nats by which another pattern explains the window better: one frame that differs is no reason to
// wait with a decision, three are one to withdraw it.
constexpr double kHardlyOurs = 5.0;
constexpr double kForeign = 11.0;

// After a brief absence, beyond the dark times of codes, little is in doubt. After the other one
// the assigned code is forgotten.
constexpr Duration kBriefAbsence = std::chrono::milliseconds{100};
constexpr Duration kForgottenAfter = std::chrono::milliseconds{600};

// What is expected is named before it is read, for so long and if so probable.
constexpr Duration kPredictionTime = std::chrono::milliseconds{300};
constexpr double kForetold = 0.95;

}  // namespace

IdDecoder::IdDecoder(const IdLibrary& library, const VisionConfig& config, double rate_hz,
                     std::optional<RobotId> own)
    : sources_(library, config.flip_rate, own),
      max_wrong_id_(config.max_wrong_id),
      max_false_robot_(config.max_false_robot) {
  for (const auto& [id, blink] : library.entries()) {
    window_ = std::max({window_, kMinWindow, kWindowPeriods * blink.period()});
    longest_dark_ = std::max(longest_dark_, longest_dark_of(blink));
    most_dark_runs_ = std::max(most_dark_runs_, most_dark_runs_of(blink));
  }
  darkness_ = longest_dark_ + from_seconds(kMissedFrames / rate_hz);
  longest_dark_ += from_seconds(kDarkFrames / rate_hz);
}

void IdDecoder::observe_lit(BlinkEvidence& evidence, Timestamp stamp,
                            const PhaseMemory& known) const {
  end_absence(evidence, stamp);
  if (count_dark_run(evidence, stamp, most_dark_runs_) && !evidence.assigned)
    forget_old(evidence, stamp + 2 * window_);  // what it showed was read otherwise
  evidence.last_lit = stamp;
  const std::size_t unsure = evidence.is_obstructed ? 1 : 0;
  for (std::size_t i = 0; i < evidence.pending_dark.size(); ++i) {
    const BlinkObservation dark{evidence.pending_dark[i], false};
    if (i >= unsure && i + unsure < evidence.pending_dark.size()) {
      add(evidence, dark);
    } else if (!evidence.shaded.is_full()) {
      evidence.shaded.push(dark);  // for comparisons with other boards
    }
  }
  evidence.pending_dark.clear();
  add(evidence, {stamp, true});
  if (evidence.score.empty()) return;
  if (!evidence.assigned) {
    decide(evidence, stamp, known);
  } else if (has_changed(evidence)) {
    evidence.forget();
    evidence.last_lit = stamp;
  } else {
    const CodeModel& code = sources_.codes()[evidence.assigned->code];
    // Its clock drifts.
    evidence.assigned->phase = best_phase(SourceModels::scores_of(evidence, code));
    review(evidence, stamp);
  }
  if (is_identified(evidence)) evidence.predictable_until.reset();
}

void IdDecoder::observe_dark(BlinkEvidence& evidence, Timestamp stamp) const {
  if (evidence.last_lit && stamp - *evidence.last_lit <= longest_dark_ &&
      evidence.pending_dark.size() < BlinkWindow::kCapacity / 2)
    evidence.pending_dark.push_back(stamp);
}

/// Darkness says something where a code is as dark; otherwise the source was hidden. What appears
/// in its place may be another one.
void IdDecoder::end_absence(BlinkEvidence& evidence, Timestamp stamp) const {
  auto& dark = evidence.pending_dark;
  if (!dark.empty() && dark.back() - dark.front() > darkness_) dark.clear();
  if (!evidence.last_lit) return;
  const Duration absence = stamp - *evidence.last_lit;
  if (absence <= longest_dark_) return;
  dark.clear();
  if (!evidence.assigned) return;
  if (absence > kForgottenAfter) return evidence.forget();
  const Duration brief = kBriefAbsence + longest_dark_;
  doubt_after_absence(evidence, absence, brief);
  if (absence > brief) evidence.predictable_until = stamp + kPredictionTime;
}

void IdDecoder::add(BlinkEvidence& evidence, BlinkObservation observation) const {
  forget_old(evidence, observation.stamp);
  evidence.window.push(observation);
  if (!evidence.score.empty()) {
    sources_.score(evidence, observation, 1);
  } else if (!observation.lit) {
    // A source that was never dark needs no scores. Most lamps and reflections never do.
    sources_.fill_scores(evidence, 0);
    for (std::size_t i = 0; i < evidence.window.size(); ++i)
      sources_.score(evidence, evidence.window[i], 1);
  }
  if (const auto p_lit = lit_probability(evidence, observation.stamp))
    test_frame(evidence, observation, *p_lit);
}

void IdDecoder::forget_old(BlinkEvidence& evidence, Timestamp now) const {
  auto& window = evidence.window;
  while (window.is_full() || (window.size() > 0 && window[0].stamp < now - window_)) {
    if (!evidence.score.empty()) sources_.score(evidence, window[0], -1);
    window.pop();
  }
  auto& shaded = evidence.shaded;
  while (shaded.size() > 0 && shaded[0].stamp < now - window_) shaded.pop();
}

void IdDecoder::decide(BlinkEvidence& evidence, Timestamp now, const PhaseMemory& known) const {
  const IdPosterior posterior = posterior_of(evidence, sources_, now, known);
  const std::size_t best = posterior.best;
  evidence.foretold = evidence.expected == best ? posterior.probability() : 0.0;
  if (best == sources_.own() || posterior.others > max_wrong_id_ ||
      posterior.clutter > max_false_robot_)
    return;
  const CodeModel& code = sources_.codes()[best];
  if (now < evidence.compared_at + code.period / kComparisonsPerPeriod) return;
  evidence.compared_at = now;
  const std::size_t phase = best_phase(SourceModels::scores_of(evidence, code));
  const bool is_hardly_ours = is_explained_better(evidence.window, code, phase, kHardlyOurs);
  evidence.is_foreign =
      is_hardly_ours && is_explained_better(evidence.window, code, phase, kForeign);
  if (is_hardly_ours) return;
  if (shaded_log_odds(evidence, sources_, {best, phase}, kNever) > kHardlyOurs) {
    evidence.forget();  // no blade is in front of it: it is read as one in the clear
    evidence.last_lit = now;
    return;
  }
  evidence.assigned = {best, phase};
  if (evidence.expected != best) evidence.assigned_since = now;
  clear_doubt(evidence, now);
}

/// Takes the ID back from what only seems to be the assigned board: another one of the swarm that
/// looks like it, hidden at times, or one of another swarm. The latter only where no frames were
/// left out, since what is left of a board's code may fit another pattern better.
void IdDecoder::review(BlinkEvidence& evidence, Timestamp now) const {
  const auto [assigned, phase] = *evidence.assigned;
  const CodeModel& code = sources_.codes()[assigned];
  if (now < evidence.compared_at + code.period / kComparisonsPerPeriod) return;
  evidence.compared_at = now;
  const Timestamp since = now - kPeriodsCompared * code.period;
  const Timestamp doubted_since = std::max(evidence.undoubted_at, since);
  if ((has_changed_or_is_obstructed(evidence) &&
       is_lost_to(rival_log_odds(evidence, sources_, doubted_since))) ||
      is_lost_to(shaded_log_odds(evidence, sources_, *evidence.assigned, since))) {
    evidence.forget();
    evidence.last_lit = now;
  } else if (evidence.shaded.size() == 0 &&
             is_explained_better(evidence.window, code, phase, kForeign)) {
    read_again(evidence);
  }
}

/// Withdraws the decision: it is a foreign board. What was observed remains.
void IdDecoder::read_again(BlinkEvidence& evidence) const {
  BlinkEvidence again;
  again.last_lit = evidence.last_lit;
  again.window = std::move(evidence.window);
  again.compared_at = evidence.compared_at;
  again.is_foreign = true;
  sources_.fill_scores(again, 0);
  for (std::size_t i = 0; i < again.window.size(); ++i) sources_.score(again, again.window[i], 1);
  evidence = std::move(again);
}

bool IdDecoder::is_worth_keeping(const BlinkEvidence& evidence) {
  return is_identified(evidence) || (!evidence.assigned && !evidence.score.empty());
}

void IdDecoder::resume(BlinkEvidence& evidence, Timestamp now, double stranger) const {
  if (!is_worth_keeping(evidence) || !evidence.last_lit) return evidence.forget();
  make_prior(evidence, sources_, now - *evidence.last_lit, stranger);
  evidence.window.clear();
  evidence.shaded.clear();
  evidence.pending_dark.clear();
  evidence.last_lit.reset();
  evidence.assigned.reset();
  clear_doubt(evidence, now);
  evidence.dark_runs = 0.0;
  evidence.is_obstructed = false;
  evidence.foretold = 0.0;
  evidence.predictable_until = now + kPredictionTime;
}

void IdDecoder::update_phase(const BlinkEvidence& evidence, Timestamp now,
                             PhaseMemory& known) const {
  if (!is_identified(evidence)) return;
  const Duration enough = kPeriodsToLearn * sources_.codes()[evidence.assigned->code].period;
  if (now - evidence.assigned_since >= enough) known.update(*evidence.assigned, now);
}

bool IdDecoder::is_identified(const BlinkEvidence& evidence) { return is_undoubted(evidence); }

std::optional<RobotId> IdDecoder::id_of(const BlinkEvidence& evidence) const {
  if (!is_identified(evidence)) return std::nullopt;
  return code_id(*evidence.assigned);
}

std::optional<RobotId> IdDecoder::predicted_id(const BlinkEvidence& evidence, Timestamp now) const {
  if (is_identified(evidence) || !evidence.predictable_until || now > *evidence.predictable_until)
    return std::nullopt;
  if (evidence.assigned) {
    if (!may_have_returned(evidence)) return std::nullopt;
    return code_id(*evidence.assigned);
  }
  if (!evidence.expected || evidence.foretold < kForetold) return std::nullopt;
  return sources_.codes()[*evidence.expected].id;
}

std::optional<double> IdDecoder::lit_probability(const BlinkEvidence& evidence,
                                                 Timestamp stamp) const {
  if (!evidence.assigned) return std::nullopt;
  const CodeModel& code = sources_.codes()[evidence.assigned->code];
  return code.lit_probability(evidence.assigned->phase, stamp);
}

}  // namespace crepes
