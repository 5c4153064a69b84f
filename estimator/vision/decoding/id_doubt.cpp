#include "estimator/vision/decoding/id_doubt.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

// If a track continues on another board, that board's code differs in a fifth of the frames.
constexpr double kOtherDiffers = 0.2;
const double kDoubted = std::log(60.0);
const double kLost = std::log(20'000.0);
constexpr double kObstructedCost = 2.0;  // nats; most sources are seen whenever they are lit
constexpr double kShown = 0.9;           // of the frames of one that is not
constexpr double kShortDoubt = 0.7;      // of kDoubted, after a brief absence
constexpr double kAbsenceDoubt = 3.3;    // nats beyond kDoubted

/// The doubt of the more likely of both: a source in the clear, or an obstructed one.
double doubt_of(const BlinkEvidence& evidence) {
  return std::min(evidence.doubt, evidence.obstructed_doubt + kObstructedCost);
}

}  // namespace

void test_frame(BlinkEvidence& evidence, BlinkObservation seen, double p_lit) {
  const auto after = [&](double doubt, double shown) {
    const double p = seen.lit ? shown * p_lit : 1.0 - shown * p_lit;
    const double q = seen.lit ? shown * (1.0 - p_lit) : 1.0 - shown * (1.0 - p_lit);
    return std::clamp(doubt + std::log(((1.0 - kOtherDiffers) * p + kOtherDiffers * q) / p), 0.0,
                      kLost + 1.0);
  };
  evidence.doubt = after(evidence.doubt, 1.0);
  evidence.obstructed_doubt = after(evidence.obstructed_doubt, kShown);
  if (evidence.doubt == 0.0) evidence.undoubted_at = seen.stamp;
}

void doubt_after_absence(BlinkEvidence& evidence, Duration absence, Duration brief) {
  const double doubt = absence > brief
                           ? kDoubted + kAbsenceDoubt
                           : kShortDoubt * kDoubted * to_seconds(absence) / to_seconds(brief);
  evidence.doubt = std::max(evidence.doubt, doubt);
  evidence.obstructed_doubt = std::max(evidence.obstructed_doubt, doubt - kObstructedCost);
}

void clear_doubt(BlinkEvidence& evidence, Timestamp now) {
  evidence.doubt = 0.0;
  evidence.obstructed_doubt = 0.0;
  evidence.undoubted_at = now;
}

bool is_undoubted(const BlinkEvidence& evidence) {
  return evidence.assigned && doubt_of(evidence) <= kDoubted;
}

bool may_have_returned(const BlinkEvidence& evidence) {
  return doubt_of(evidence) <= kDoubted + kAbsenceDoubt;
}

bool has_changed(const BlinkEvidence& evidence) { return doubt_of(evidence) > kLost; }

bool has_changed_or_is_obstructed(const BlinkEvidence& evidence) { return evidence.doubt > kLost; }

bool is_lost_to(double rival_log_odds) { return rival_log_odds > kLost; }

}  // namespace crepes
