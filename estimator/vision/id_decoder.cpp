#include "estimator/vision/id_decoder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

// Limits of a camera.
constexpr Duration kPhaseStep = 625us;
constexpr std::size_t kMaxPhases = 320;
constexpr Duration kEdgeBlur = 500us;  // half an exposure: with an edge within, both are possible
constexpr double kDarkFrames = 6.0;    // margin of a dark run: its edges, missed frames
constexpr std::int64_t kWindowPeriods = 6;
constexpr Duration kMinWindow = 1200ms;
constexpr double kMinFlipRate = 0.02;  // with less, a single frame would count too much
constexpr double kMaxFlipRate = 0.3;
constexpr double kUnitsPerNat = 24.0;  // a full window of the least likely frames fits 16 bits

// Priors, as odds or shares relative to a board of the library in any phase.
constexpr double kMarkovOdds = 1.0;    // a source that changes like a Markov chain
constexpr double kLampOdds = 1.0;      // a lamp on the mains
constexpr double kMirrorShare = 0.01;  // the observer's own board in a mirror
constexpr double kReturnOdds = 100.0;  // a board that returns in its known phase
constexpr double kStrangerOdds = 1.0;  // the same where another light is expected
constexpr double kImageOdds = 0.1;     // a second image of a board that is in sight
constexpr Duration kInSight = 200ms;   // a board counts as in sight for this long
constexpr double kMaxSkew = 200e-6;    // between two crystals
constexpr Duration kPhaseError = 2500us;
constexpr Duration kOldPhase = 30s;  // an older phase is too uncertain
constexpr std::int64_t kPeriodsToLearn = 2;
constexpr double kImpossible = -1e9;
constexpr double kNegligible = 40.0;    // nats
constexpr double kLeastLikely = -50.0;  // nats; of what is as good as excluded

// If a track continues on another board, that board's code differs in a fifth of the frames.
constexpr double kOtherDiffers = 0.2;
const double kDoubted = std::log(60.0);
const double kLost = std::log(20'000.0);
constexpr double kObstructedCost = 2.0;  // nats; most sources are seen whenever they are lit
constexpr double kShown = 0.9;           // of the frames of one that is not
constexpr double kMissedFrames = 2.0;    // at the edges of a dark run

// After an absence, the doubt that what is lit is what was: none in frames that follow each other,
// and so much after a while that fifteen frames in a row have to agree.
constexpr Duration kShortAbsence = 100ms;
constexpr Duration kLongestAbsence = 600ms;
constexpr double kShortDoubt = 0.7;    // of kDoubted, after kShortAbsence
constexpr double kAbsenceDoubt = 3.3;  // nats beyond kDoubted

// What is expected is named before it is read, for so long and if so probable.
constexpr Duration kPredictionTime = 300ms;
constexpr double kForetold = 0.95;

// A source that goes dark so many times as often as a board can, of late, is behind a propeller.
constexpr double kObstructedRuns = 1.25;
constexpr double kClearRuns = 1.0;
constexpr double kRunMemory = 0.3;  // s

// Lamps on the mains flash twice a cycle. A camera can hardly distinguish finer steps of duty.
constexpr std::array kLampRatesHz{100.0, 120.0};
constexpr std::array kLampDuties{0.1, 0.25, 0.4, 0.55, 0.7, 0.85};

void add_scaled(std::span<std::int16_t> sum, const std::int16_t* weight, int sign) {
  if (sign > 0) {
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] = static_cast<std::int16_t>(sum[i] + weight[i]);
  } else {
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] = static_cast<std::int16_t>(sum[i] - weight[i]);
  }
}

std::int16_t highest(std::span<const std::int16_t> scores) {
  std::int16_t best = scores[0];
  for (const std::int16_t s : scores) best = std::max(best, s);
  return best;
}

/// The log of the mean likelihood over all phases, approximated: the best score, times the share of
/// phases within a nat of it.
double log_mean(std::span<const std::int16_t> scores, std::int16_t top) {
  const auto nearly = static_cast<std::int16_t>(top - kUnitsPerNat);
  std::int16_t like_top = 0;
  for (const std::int16_t s : scores)
    like_top = static_cast<std::int16_t>(like_top + (s >= nearly ? 1 : 0));
  return top / kUnitsPerNat +
         std::log(static_cast<double>(like_top) / static_cast<double>(scores.size()));
}

std::int16_t to_units(double nats) {
  return static_cast<std::int16_t>(std::lround(kUnitsPerNat * nats));
}

/// The middle of the run of phases that share the best score.
std::size_t best_phase(std::span<const std::int16_t> scores) {
  const std::size_t n = scores.size();
  const std::int16_t top = highest(scores);
  const auto at =
      static_cast<std::size_t>(std::find(scores.begin(), scores.end(), top) - scores.begin());
  std::size_t after = 0;
  std::size_t before = 0;
  while (after + 1 < n && scores[(at + after + 1) % n] == top) ++after;
  while (before + after + 1 < n && scores[(at + n - before - 1) % n] == top) ++before;
  return (at + n - before + (before + after) / 2) % n;
}

Duration longest_dark_of(const BlinkCode& code) {
  constexpr Duration kStep = 500us;
  Duration longest{};
  Duration current{};
  for (Duration t{}; t < 2 * code.period(); t += kStep) {
    current = code.is_lit(t) ? Duration{} : current + kStep;
    longest = std::max(longest, current);
  }
  return longest;
}

/// The most that BlinkEvidence::dark_runs becomes before a board in the clear.
double most_dark_runs_of(const BlinkCode& code) {
  constexpr Duration kStep = 500us;
  const Duration settled = from_seconds(4.0 * kRunMemory) + code.period();
  const double fading = std::exp(-to_seconds(kStep) / kRunMemory);
  double runs = 0.0;
  double most = 0.0;
  bool was_lit = true;
  for (Duration t{}; t < settled; t += kStep) {
    const bool is_lit = code.is_lit(t);
    runs = fading * runs + (was_lit && !is_lit ? 1.0 : 0.0);
    most = std::max(most, runs);
    was_lit = is_lit;
  }
  return most;
}

}  // namespace

void BlinkEvidence::forget() {
  window.clear();
  pending_dark.clear();
  score.clear();
  last_lit.reset();
  assigned.reset();
  confidence = 0.0;
  doubt = 0.0;
  obstructed_doubt = 0.0;
  dark_runs = 0.0;
  is_obstructed = false;
  earlier_markov = 0.0;
  expected.reset();
  foretold = 0.0;
  predictable_until.reset();
}

void PhaseMemory::update(const CodeMatch& match, Timestamp now) {
  if (match.code >= phases_.size()) phases_.resize(match.code + 1);
  if (!phases_[match.code]) ++known_;
  phases_[match.code] = {match.phase, now};
}

IdDecoder::IdDecoder(const IdLibrary& library, const VisionConfig& config, double rate_hz,
                     std::optional<RobotId> own)
    : max_wrong_id_(config.max_wrong_id), max_false_robot_(config.max_false_robot) {
  const double flip_rate = std::clamp(config.flip_rate, kMinFlipRate, kMaxFlipRate);
  boards_ = library.entries().size();
  for (const auto& [id, blink] : library.entries()) {
    if (id == own) own_ = codes_.size();
    const double share = id == own ? kMirrorShare : 1.0;
    add_code(make_code(blink, flip_rate), share / static_cast<double>(boards_));
    codes_.back().id = id;
    window_ = std::max({window_, kMinWindow, kWindowPeriods * blink.period()});
    longest_dark_ = std::max(longest_dark_, longest_dark_of(blink));
    most_dark_runs_ = std::max(most_dark_runs_, most_dark_runs_of(blink));
  }
  darkness_ = longest_dark_ + from_seconds(kMissedFrames / rate_hz);
  longest_dark_ += from_seconds(kDarkFrames / rate_hz);
  constexpr double kShare =
      kLampOdds / static_cast<double>(kLampRatesHz.size() * kLampDuties.size());
  for (const double hz : kLampRatesHz) {
    for (const double duty : kLampDuties) {
      const auto lamp = BlinkCode::from_duty(duty, from_seconds(1.0 / hz));
      CREPES_EXPECT(lamp.has_value(), "duties of lamps lie between 0 and 1");
      add_code(make_code(*lamp, flip_rate), kShare);
    }
  }
}

void IdDecoder::add_code(Code code, double share) {
  code.first_score = score_count_;
  score_count_ += code.phases;
  code.log_share = std::log(share);
  codes_.push_back(std::move(code));
}

IdDecoder::Code IdDecoder::make_code(const BlinkCode& blink, double flip_rate) {
  Code code;
  code.period = blink.period();
  code.phases =
      std::clamp<std::size_t>(static_cast<std::size_t>(code.period / kPhaseStep), 8, kMaxPhases);
  const std::size_t steps = code.phases * kFine;
  const auto step_count = static_cast<std::int64_t>(steps);
  // A step represents all phases and times that are rounded to it.
  const Duration spread =
      code.period * 3 / (4 * static_cast<std::int64_t>(code.phases)) + kEdgeBlur;
  for (std::int64_t i = 0; i < step_count; ++i) {
    const Duration t = code.period * (2 * i + 1) / (2 * step_count);
    const double lit = blink.lit_fraction(t - spread, t + spread);
    code.p_lit.push_back(flip_rate + (1.0 - 2.0 * flip_rate) * lit);
  }
  for (const std::size_t lit : {0U, 1U}) {
    for (std::size_t offset = 0; offset < kFine; ++offset) {
      for (std::size_t k = 0; k < 2 * code.phases; ++k) {
        const double p = code.p_lit[(k * kFine + offset) % steps];
        code.weight[lit][offset].push_back(static_cast<std::int16_t>(
            std::lround(kUnitsPerNat * std::log(lit != 0 ? p : 1.0 - p))));
      }
    }
  }
  return code;
}

std::size_t IdDecoder::fine_index(const Code& code, Timestamp stamp) {
  const std::int64_t period = code.period.count();
  const std::int64_t within = ((to_ns(stamp) % period) + period) % period;
  return static_cast<std::size_t>(within * static_cast<std::int64_t>(code.phases * kFine) / period);
}

double IdDecoder::p_lit(const Code& code, std::size_t phase, Timestamp stamp) {
  return code.p_lit[(fine_index(code, stamp) + phase * kFine) % code.p_lit.size()];
}

std::span<const std::int16_t> IdDecoder::scores_of(const BlinkEvidence& evidence,
                                                   const Code& code) {
  return std::span(evidence.score).subspan(code.first_score, code.phases);
}

/// Adds (`sign` 1) or removes (-1) an observation: for all codes while undecided, afterwards for
/// the assigned code only.
void IdDecoder::score(BlinkEvidence& evidence, BlinkObservation observation, int sign) const {
  const std::size_t first = evidence.assigned ? evidence.assigned->code : 0;
  const std::size_t end = evidence.assigned ? first + 1 : codes_.size();
  for (std::size_t c = first; c < end; ++c) {
    const Code& code = codes_[c];
    const std::size_t fine = fine_index(code, observation.stamp);
    const auto& weight = code.weight[observation.lit ? 1 : 0][fine % kFine];
    add_scaled(std::span(evidence.score).subspan(code.first_score, code.phases),
               weight.data() + fine / kFine, sign);
  }
}

void IdDecoder::add(BlinkEvidence& evidence, BlinkObservation observation) const {
  forget_old(evidence, observation.stamp);
  evidence.window.push(observation);
  if (!evidence.score.empty()) {
    score(evidence, observation, 1);
  } else if (!observation.lit) {
    // A source that was never dark needs no scores. Most lamps and reflections never do.
    evidence.score.assign(score_count_, 0);
    for (std::size_t i = 0; i < evidence.window.size(); ++i) score(evidence, evidence.window[i], 1);
  }
  if (evidence.assigned) confirm(evidence, observation);
}

void IdDecoder::forget_old(BlinkEvidence& evidence, Timestamp now) const {
  auto& window = evidence.window;
  while (window.is_full() || (window.size() > 0 && window[0].stamp < now - window_)) {
    if (!evidence.score.empty()) score(evidence, window[0], -1);
    window.pop();
  }
}

void IdDecoder::observe_dark(BlinkEvidence& evidence, Timestamp stamp) const {
  if (evidence.last_lit && stamp - *evidence.last_lit <= longest_dark_ &&
      evidence.pending_dark.size() < BlinkWindow::kCapacity / 2)
    evidence.pending_dark.push_back(stamp);
}

void IdDecoder::observe_lit(BlinkEvidence& evidence, Timestamp stamp,
                            const PhaseMemory& known) const {
  end_absence(evidence, stamp);
  count_dark_run(evidence, stamp);
  evidence.last_lit = stamp;
  const std::size_t unsure = evidence.is_obstructed ? 1 : 0;
  for (std::size_t i = unsure; i + unsure < evidence.pending_dark.size(); ++i)
    add(evidence, {evidence.pending_dark[i], false});
  evidence.pending_dark.clear();
  add(evidence, {stamp, true});
  if (evidence.score.empty()) return;
  if (!evidence.assigned) {
    decide(evidence, stamp, known);
  } else if (doubt_of(evidence) > kLost) {
    evidence.forget();
    evidence.last_lit = stamp;
  } else {
    const Code& code = codes_[evidence.assigned->code];
    evidence.assigned->phase = best_phase(scores_of(evidence, code));  // its clock drifts
  }
  if (is_identified(evidence)) evidence.predictable_until.reset();
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
  if (absence > kLongestAbsence) return evidence.forget();
  const Duration brief = kShortAbsence + longest_dark_;
  const double doubt = absence > brief
                           ? kDoubted + kAbsenceDoubt
                           : kShortDoubt * kDoubted * to_seconds(absence) / to_seconds(brief);
  evidence.doubt = std::max(evidence.doubt, doubt);
  evidence.obstructed_doubt = std::max(evidence.obstructed_doubt, doubt - kObstructedCost);
  if (absence > brief) evidence.predictable_until = stamp + kPredictionTime;
}

bool IdDecoder::is_worth_keeping(const BlinkEvidence& evidence) {
  return is_identified(evidence) || (!evidence.assigned && !evidence.score.empty());
}

/// With s = p(stranger), likelihoods become those of a source that may have been replaced:
///   L(code, phase) <- (1 - s) L(code, phase) / mean L + s.
void IdDecoder::resume(BlinkEvidence& evidence, Timestamp now, double stranger) const {
  if (!is_worth_keeping(evidence) || !evidence.last_lit) return evidence.forget();
  if (evidence.assigned) {
    expect(evidence, now - *evidence.last_lit);
  } else {
    summarize(evidence);
  }
  const std::int16_t least = to_units(std::log(stranger));
  for (std::int16_t& score : evidence.score) score = std::max(score, least);
  evidence.earlier_markov = std::max(evidence.earlier_markov, std::log(stranger));
  evidence.window.clear();
  evidence.pending_dark.clear();
  evidence.last_lit.reset();
  evidence.assigned.reset();
  evidence.doubt = 0.0;
  evidence.obstructed_doubt = 0.0;
  evidence.dark_runs = 0.0;
  evidence.is_obstructed = false;
  evidence.foretold = 0.0;
  evidence.predictable_until = now + kPredictionTime;
}

/// All of the likelihood is with the assigned code, in the phases that its clock may have by now.
void IdDecoder::expect(BlinkEvidence& evidence, Duration absence) const {
  const CodeMatch was = *evidence.assigned;
  const Code& code = codes_[was.code];
  const auto n = static_cast<std::int64_t>(code.phases);
  const std::int64_t reach = phase_reach(code, absence);
  const double share = static_cast<double>(2 * reach + 1) / static_cast<double>(n);
  evidence.score.assign(score_count_, to_units(kLeastLikely));
  for (std::int64_t i = -reach; i <= reach; ++i) {
    const std::int64_t at = (static_cast<std::int64_t>(was.phase) + i + n) % n;
    evidence.score[code.first_score + static_cast<std::size_t>(at)] =
        to_units(-std::log(share) - code.log_share);
  }
  evidence.earlier_markov = kLeastLikely;
  evidence.expected = was.code;
}

void IdDecoder::summarize(BlinkEvidence& evidence) const {
  const double mean = log_evidence(evidence);
  const int shift = to_units(mean);
  const int least = to_units(kLeastLikely);
  constexpr int kMost = std::numeric_limits<std::int16_t>::max();
  for (std::int16_t& score : evidence.score)
    score = static_cast<std::int16_t>(std::clamp(score - shift, least, kMost));
  evidence.earlier_markov = log_markov(evidence) - mean;
}

/// The log of the mean likelihood of all sources, by their priors.
double IdDecoder::log_evidence(const BlinkEvidence& evidence) const {
  double top = log_markov(evidence) + std::log(kMarkovOdds);
  double sum = 1.0;  // relative to the top
  for (const Code& code : codes_) {
    const auto scores = scores_of(evidence, code);
    const double log_code = log_mean(scores, highest(scores)) + code.log_share;
    sum = log_code > top ? sum * std::exp(top - log_code) + 1.0 : sum + std::exp(log_code - top);
    top = std::max(top, log_code);
  }
  return top + std::log(sum / (1.0 + kMarkovOdds + kLampOdds));
}

/// A blade is shorter before the light than two frames are apart. So it hides single frames, or one
/// at either end of a dark slot.
void IdDecoder::count_dark_run(BlinkEvidence& evidence, Timestamp stamp) const {
  if (!evidence.last_lit) return;
  evidence.dark_runs *= std::exp(-to_seconds(stamp - *evidence.last_lit) / kRunMemory);
  evidence.dark_runs += evidence.pending_dark.empty() ? 0.0 : 1.0;
  const double most = (evidence.is_obstructed ? kClearRuns : kObstructedRuns) * most_dark_runs_;
  const bool was_obstructed = std::exchange(evidence.is_obstructed, evidence.dark_runs > most);
  if (evidence.is_obstructed == was_obstructed || evidence.assigned) return;
  forget_old(evidence, stamp + 2 * window_);  // what it showed was read otherwise
}

void IdDecoder::update_phase(const BlinkEvidence& evidence, Timestamp now,
                             PhaseMemory& known) const {
  if (!is_identified(evidence)) return;
  const Duration enough = kPeriodsToLearn * codes_[evidence.assigned->code].period;
  if (now - evidence.assigned_since >= enough) known.update(*evidence.assigned, now);
}

/// So many steps a phase may be off that was known `age` ago.
std::int64_t IdDecoder::phase_reach(const Code& code, Duration age) {
  const Duration error = kPhaseError + from_seconds(kMaxSkew * to_seconds(age));
  return error * static_cast<std::int64_t>(code.phases) / code.period + 1;
}

/// Log likelihood plus log prior of a code whose phase continues from its last sighting.
double IdDecoder::log_known(const BlinkEvidence& evidence, std::size_t code, Timestamp now,
                            const PhaseMemory& known) const {
  const auto phase = known.of(code);
  if (!phase || now - phase->learned > kOldPhase) return kImpossible;
  const auto scores = scores_of(evidence, codes_[code]);
  const auto n = static_cast<std::int64_t>(scores.size());
  const std::int64_t reach = phase_reach(codes_[code], now - phase->learned);
  if (2 * reach >= n) return kImpossible;
  double likelihood = 0.0;
  for (std::int64_t i = -reach; i <= reach; ++i) {
    const std::int64_t at = (static_cast<std::int64_t>(phase->phase) + i + n) % n;
    likelihood +=
        std::exp((scores[static_cast<std::size_t>(at)] - scores[phase->phase]) / kUnitsPerNat);
  }
  const double returns = evidence.expected ? kStrangerOdds : kReturnOdds;
  const double odds = now - phase->learned > kInSight ? returns : kImageOdds;
  const auto others = static_cast<double>(known.size() * static_cast<std::size_t>(2 * reach + 1));
  return scores[phase->phase] / kUnitsPerNat + std::log(likelihood * odds / others) +
         (own_ == code ? std::log(kMirrorShare) : 0.0);
}

void IdDecoder::decide(BlinkEvidence& evidence, Timestamp now, const PhaseMemory& known) const {
  double best_log = kImpossible;
  const auto anywhere = [&](const Code& code) {
    const auto scores = scores_of(evidence, code);
    const std::int16_t top = highest(scores);
    const double at_most = top / kUnitsPerNat + code.log_share;
    return at_most < best_log - kNegligible ? kImpossible : log_mean(scores, top) + code.log_share;
  };
  double others = 0.0;  // posterior of all other codes, relative to the best one
  std::size_t best = 0;
  for (std::size_t c = 0; c < boards_; ++c) {
    // What is expected here in its phase has that in its score already.
    const double log_c = c == evidence.expected
                             ? anywhere(codes_[c])
                             : std::max(anywhere(codes_[c]), log_known(evidence, c, now, known));
    if (log_c > best_log) {
      others = (others + 1.0) * std::exp(best_log - log_c);
      best_log = log_c;
      best = c;
    } else {
      others += std::exp(log_c - best_log);
    }
  }
  double clutter = kMarkovOdds * std::exp(log_markov(evidence) - best_log);
  for (std::size_t c = boards_; c < codes_.size(); ++c)
    clutter += std::exp(anywhere(codes_[c]) - best_log);
  evidence.foretold = evidence.expected == best ? 1.0 / (1.0 + others + clutter) : 0.0;
  if (best == own_ || others > max_wrong_id_ || clutter > max_false_robot_) return;
  evidence.assigned = {best, best_phase(scores_of(evidence, codes_[best]))};
  if (evidence.expected != best) evidence.assigned_since = now;
  evidence.confidence = 1.0 / (1.0 + others + clutter);
  evidence.doubt = 0.0;
  evidence.obstructed_doubt = 0.0;
}

/// Page's test (CUSUM) for a change of the source: the log odds g that another board has been
/// blinking here since some past frame,
///   g <- max(0, g + ln(((1 - d) p + d q) / p)),
/// where p is the likelihood of the frame under the assigned code, q that under its opposite, and d
/// the share of frames in which another board differs. It runs twice: for a source in the clear,
/// and for one that is hidden in half of the frames, whose darkness says little.
void IdDecoder::confirm(BlinkEvidence& evidence, BlinkObservation observation) const {
  const double lit =
      p_lit(codes_[evidence.assigned->code], evidence.assigned->phase, observation.stamp);
  const auto after = [&](double doubt, double shown) {
    const double p = observation.lit ? shown * lit : 1.0 - shown * lit;
    const double q = observation.lit ? shown * (1.0 - lit) : 1.0 - shown * (1.0 - lit);
    return std::clamp(doubt + std::log(((1.0 - kOtherDiffers) * p + kOtherDiffers * q) / p), 0.0,
                      kLost + 1.0);
  };
  evidence.doubt = after(evidence.doubt, 1.0);
  evidence.obstructed_doubt = after(evidence.obstructed_doubt, kShown);
}

double IdDecoder::doubt_of(const BlinkEvidence& evidence) {
  return std::min(evidence.doubt, evidence.obstructed_doubt + kObstructedCost);
}

bool IdDecoder::is_identified(const BlinkEvidence& evidence) {
  return evidence.assigned && doubt_of(evidence) <= kDoubted;
}

std::optional<RobotId> IdDecoder::id_of(const BlinkEvidence& evidence) const {
  if (!is_identified(evidence)) return std::nullopt;
  return codes_[evidence.assigned->code].id;
}

std::optional<RobotId> IdDecoder::predicted_id(const BlinkEvidence& evidence, Timestamp now) const {
  if (is_identified(evidence) || !evidence.predictable_until || now > *evidence.predictable_until)
    return std::nullopt;
  if (evidence.assigned) {
    if (doubt_of(evidence) > kDoubted + kAbsenceDoubt) return std::nullopt;
    return codes_[evidence.assigned->code].id;
  }
  if (!evidence.expected || evidence.foretold < kForetold) return std::nullopt;
  return codes_[*evidence.expected].id;
}

std::optional<std::size_t> IdDecoder::code_of(RobotId robot) const {
  const std::span boards(codes_.data(), boards_);
  const auto found = std::ranges::find(boards, robot, &Code::id);
  if (found == boards.end()) return std::nullopt;
  return static_cast<std::size_t>(found - boards.begin());
}

std::optional<double> IdDecoder::lit_probability(const BlinkEvidence& evidence,
                                                 Timestamp stamp) const {
  if (!evidence.assigned) return std::nullopt;
  return p_lit(codes_[evidence.assigned->code], evidence.assigned->phase, stamp);
}

}  // namespace crepes
