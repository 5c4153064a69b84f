#include "estimator/vision/id_decoder.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr Duration kPhaseStep = 625us;
constexpr Duration kEdgeBlur = 200us;  // exposure and switching
constexpr Duration kDarkSlack = 12ms;  // the frames at both edges of a dark stretch
constexpr Duration kMinCheck = 150ms;
constexpr std::size_t kMaxPhases = 320;
constexpr std::size_t kMaxWindow = 320;  // observations; keeps a score within 16 bits
constexpr std::int64_t kWindowPeriods = 4;
constexpr double kMinFlipRate = 0.02;  // lower ones trust single frames too much
constexpr double kMaxFlipRate = 0.3;
// Neighboring frames share their faults, so each counts less than an independent one would.
constexpr double kTemper = 0.75;
constexpr double kUnitsPerNat = 32.0;
constexpr double kClutterOdds = 10.0;  // sources that are no boards, for each that is one
constexpr double kLostPosterior = 0.01;

// A board that matches may err in so many frames of a check; at twice as many the ID is lost.
double tolerated(double frames) { return 1.0 + 0.06 * frames; }

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

}  // namespace

IdDecoder::IdDecoder(const IdLibrary& library, double flip_rate, double min_confidence)
    : flip_rate_(std::clamp(flip_rate, kMinFlipRate, kMaxFlipRate)),
      min_confidence_(min_confidence) {
  for (const auto& [id, blink] : library.entries()) {
    Code code;
    code.id = id;
    code.period = blink.period();
    code.check_span = code.period * ((kMinCheck - 1ns) / code.period + 1);
    code.phases =
        std::clamp<std::size_t>(static_cast<std::size_t>(code.period / kPhaseStep), 8, kMaxPhases);
    code.first_score = score_count_;
    score_count_ += code.phases;

    const std::size_t steps = code.phases * kFine;
    const auto step_count = static_cast<std::int64_t>(steps);
    // A step stands for all phases and times that are rounded to it.
    const Duration spread =
        code.period * 3 / (4 * static_cast<std::int64_t>(code.phases)) + kEdgeBlur;
    for (std::int64_t i = 0; i < step_count; ++i) {
      const Duration t = code.period * (2 * i + 1) / (2 * step_count);
      const double lit = blink.lit_fraction(t - spread, t + spread);
      code.p_lit.push_back(flip_rate_ + (1.0 - 2.0 * flip_rate_) * lit);
    }
    for (const std::size_t lit : {0U, 1U}) {
      for (std::size_t offset = 0; offset < kFine; ++offset) {
        for (std::size_t k = 0; k < 2 * code.phases; ++k) {
          const double p = code.p_lit[(k * kFine + offset) % steps];
          code.weight[lit][offset].push_back(static_cast<std::int16_t>(
              std::lround(kTemper * kUnitsPerNat * std::log(lit != 0 ? p : 1.0 - p))));
        }
      }
    }
    window_ = std::max(window_, std::max(kWindowPeriods * code.period, 2 * code.check_span));
    longest_dark_ = std::max(longest_dark_, longest_dark_of(blink) + kDarkSlack);
    codes_.push_back(std::move(code));
  }
  log_gamma_half_.push_back(0.5 * std::log(std::numbers::pi));
  log_factorial_.push_back(0.0);
  for (std::size_t n = 1; n <= kMaxWindow; ++n) {
    log_gamma_half_.push_back(log_gamma_half_.back() + std::log(static_cast<double>(n) - 0.5));
    log_factorial_.push_back(log_factorial_.back() + std::log(static_cast<double>(n)));
  }
}

std::size_t IdDecoder::fine_index(const Code& code, Timestamp stamp) {
  const std::int64_t period = code.period.count();
  const std::int64_t within = ((to_ns(stamp) % period) + period) % period;
  return static_cast<std::size_t>(within * static_cast<std::int64_t>(code.phases * kFine) / period);
}

double IdDecoder::p_lit(const Code& code, std::size_t phase, Timestamp stamp) {
  return code.p_lit[(fine_index(code, stamp) + phase * kFine) % code.p_lit.size()];
}

void IdDecoder::score(BlinkEvidence& evidence, BlinkEvidence::Observation observation,
                      int sign) const {
  for (const Code& code : codes_) {
    const std::size_t fine = fine_index(code, observation.stamp);
    const auto& weight = code.weight[observation.lit ? 1 : 0][fine % kFine];
    add_scaled(std::span(evidence.score).subspan(code.first_score, code.phases),
               weight.data() + fine / kFine, sign);
  }
}

void IdDecoder::add(BlinkEvidence& evidence, BlinkEvidence::Observation observation) const {
  if (!evidence.window.empty())
    ++evidence.steps[evidence.window.back().lit ? 1 : 0][observation.lit ? 1 : 0];
  evidence.window.push_back(observation);
  if (!evidence.score.empty()) {
    score(evidence, observation, 1);
  } else if (!observation.lit) {
    // A source that was never dark needs no scores: most lamps and reflections end here.
    evidence.score.assign(score_count_, 0);
    for (const auto& past : evidence.window) score(evidence, past, 1);
  }
}

void IdDecoder::forget_old(BlinkEvidence& evidence, Timestamp now) const {
  auto& window = evidence.window;
  while (!window.empty() && (window.front().stamp < now - window_ || window.size() >= kMaxWindow)) {
    if (!evidence.score.empty()) score(evidence, window.front(), -1);
    if (window.size() > 1) --evidence.steps[window[0].lit ? 1 : 0][window[1].lit ? 1 : 0];
    window.pop_front();
  }
}

void IdDecoder::observe_dark(BlinkEvidence& evidence, Timestamp stamp) const {
  if (evidence.last_lit && stamp - *evidence.last_lit <= longest_dark_ &&
      evidence.pending_dark.size() < kMaxWindow / 2)
    evidence.pending_dark.push_back(stamp);
}

void IdDecoder::observe_lit(BlinkEvidence& evidence, Timestamp stamp) const {
  if (!evidence.last_lit || stamp - *evidence.last_lit > longest_dark_) {
    evidence.resumed = stamp;  // it was away: what happened meanwhile says nothing about its code
    evidence.pending_dark.clear();
  }
  evidence.last_lit = stamp;
  for (const Timestamp dark : evidence.pending_dark) {
    forget_old(evidence, dark);
    add(evidence, {dark, false});
  }
  evidence.pending_dark.clear();
  forget_old(evidence, stamp);
  add(evidence, {stamp, true});
  if (!evidence.score.empty()) judge(evidence, stamp);
}

/// Krichevsky-Trofimov: the likelihood of the window's steps under a two-state Markov chain, its
/// rates integrated out,  ln prod_s Gamma(a+1/2) Gamma(b+1/2) / (pi (a+b)!).
double IdDecoder::log_markov(const BlinkEvidence& evidence) const {
  double sum = 0.0;
  for (const auto& [dark, lit] : evidence.steps) {
    const auto a = static_cast<std::size_t>(dark);
    const auto b = static_cast<std::size_t>(lit);
    sum += log_gamma_half_[a] + log_gamma_half_[b] - log_factorial_[a + b] -
           std::log(std::numbers::pi);
  }
  return sum;
}

IdDecoder::Best IdDecoder::best_of(const BlinkEvidence& evidence) const {
  Best best;
  double best_log = -1e9;
  double total = std::exp(-1e3);  // relative to best_log
  const auto include = [&](double log_likelihood) {
    if (log_likelihood > best_log) {
      total = total * std::exp(best_log - log_likelihood) + 1.0;
      best_log = log_likelihood;
      return true;
    }
    total += std::exp(log_likelihood - best_log);
    return false;
  };
  for (std::size_t c = 0; c < codes_.size(); ++c) {
    const std::span<const std::int16_t> scores =
        std::span(evidence.score).subspan(codes_[c].first_score, codes_[c].phases);
    const std::int16_t top = highest(scores);
    // About eight steps of phase look alike to a camera; the others are as likely beforehand.
    const double prior = 8.0 / static_cast<double>(codes_[c].phases * codes_.size());
    if (include(top / kUnitsPerNat + std::log(prior))) {
      // The middle of the phases that fit equally well.
      const auto first = std::find(scores.begin(), scores.end(), top);
      const auto last = std::find_if(first, scores.end(), [top](auto s) { return s != top; });
      best.match = {c, static_cast<std::size_t>((first - scores.begin()) + (last - first) / 2)};
    }
  }
  const double board_log = best_log;
  include(kTemper * log_markov(evidence) + std::log(kClutterOdds));
  best.posterior = std::exp(board_log - best_log) / total;
  return best;
}

void IdDecoder::judge(BlinkEvidence& evidence, Timestamp now) const {
  const Best best = best_of(evidence);
  const bool is_sure = best.posterior >= min_confidence_;
  if (!evidence.assigned) {
    if (!is_sure || now - evidence.window.front().stamp < codes_[best.match.code].check_span)
      return;
    evidence.assigned = best.match;
  }
  const bool is_same = best.match.code == evidence.assigned->code;
  if (is_same) evidence.assigned = best.match;  // its clock drifts
  evidence.confidence = is_same ? best.posterior : 1.0 - best.posterior;

  const Code& code = codes_[evidence.assigned->code];
  double frames = 0.0;
  double mismatches = 0.0;
  for (auto it = evidence.window.rbegin();
       it != evidence.window.rend() && it->stamp > now - code.check_span; ++it) {
    const double lit = p_lit(code, evidence.assigned->phase, it->stamp);
    frames += 1.0;
    if ((it->lit ? lit : 1.0 - lit) < 0.25) mismatches += 1.0;
  }
  evidence.is_doubted = mismatches > tolerated(frames) || evidence.confidence < 0.5 ||
                        now - evidence.resumed < code.check_span;
  if (mismatches > 2.0 * tolerated(frames) || evidence.confidence < kLostPosterior) {
    evidence = BlinkEvidence{};
    evidence.last_lit = now;
    evidence.resumed = now;
  }
}

std::optional<RobotId> IdDecoder::id_of(const BlinkEvidence& evidence) const {
  if (!is_identified(evidence)) return std::nullopt;
  return codes_[evidence.assigned->code].id;
}

std::optional<double> IdDecoder::lit_probability(const BlinkEvidence& evidence,
                                                 Timestamp stamp) const {
  if (!evidence.assigned) return std::nullopt;
  return p_lit(codes_[evidence.assigned->code], evidence.assigned->phase, stamp);
}

}  // namespace crepes
