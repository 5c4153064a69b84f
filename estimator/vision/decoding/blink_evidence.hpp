/// What the decoder keeps of one track: its recent observations, and the code assigned to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_window.hpp"

namespace crepes {

/// A code of the library in one phase.
struct CodeMatch {
  std::size_t code = 0;   ///< index into the library
  std::size_t phase = 0;  ///< in steps of the decoder, against our clock
};

/// The recent observations of one track, and the code assigned to it. A track owns it; only
/// IdDecoder and its parts change it.
struct BlinkEvidence {
  BlinkWindow window;
  BlinkWindow shaded;  ///< dark frames of the same time that a blade may have caused
  std::vector<Timestamp> pending_dark;  ///< dark frames since the last lit one; they count as
                                        ///< blinking once the track is lit again
  std::vector<std::int16_t> score;      ///< log likelihood of every code in every phase
  std::optional<Timestamp> last_lit;
  std::optional<CodeMatch> assigned;  ///< the decision; empty while undecided
  Timestamp assigned_since = kNever;  ///< over the times that it was hidden, too
  double doubt = 0.0;  ///< log odds that another board has blinked here since; at least zero
  /// The same if something hides the light in half of the frames, as a propeller does.
  double obstructed_doubt = 0.0;
  Timestamp undoubted_at = kNever;  ///< when `doubt` was zero last
  Timestamp compared_at = kNever;   ///< when other codes were compared last, ours and foreign ones
  bool is_foreign = false;          ///< its code is no board's of ours, but like one
  double dark_runs = 0.0;           ///< how often it went dark of late, with fading memory
  bool is_obstructed = false;       ///< more often than any board: a propeller is in front of it
  /// After IdDecoder::resume(), `score` contains the earlier sightings, normalized so that the mean
  /// likelihood of all sources is 1. This is the log likelihood of a two-state Markov chain
  /// relative to that mean.
  double earlier_markov = 0.0;
  std::optional<std::size_t> expected;  ///< the code that it was last, if `score` has its phase
  double foretold = 0.0;                ///< posterior probability of `expected` until it is decided
  /// Until then it may be named before it is read. Set where it appears after an absence.
  std::optional<Timestamp> predictable_until;

  /// Returns to the initial state. Allocated memory is kept.
  void forget();
};

}  // namespace crepes
