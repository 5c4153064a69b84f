#include "estimator/vision/decoding/blink_evidence.hpp"

namespace crepes {

void BlinkEvidence::forget() {
  window.clear();
  shaded.clear();
  pending_dark.clear();
  score.clear();
  last_lit.reset();
  assigned.reset();
  assigned_since = kNever;
  doubt = 0.0;
  obstructed_doubt = 0.0;
  undoubted_at = kNever;
  compared_at = kNever;
  is_foreign = false;
  dark_runs = 0.0;
  is_obstructed = false;
  earlier_markov = 0.0;
  expected.reset();
  foretold = 0.0;
  predictable_until.reset();
}

}  // namespace crepes
