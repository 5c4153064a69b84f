/// Identifies the robot's board of a track from the track's on/off history.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/vision/blink_window.hpp"
#include "estimator/vision/id_library.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

/// A code of the library in one phase.
struct CodeMatch {
  std::size_t code = 0;   ///< index into the library
  std::size_t phase = 0;  ///< in steps of the decoder, against our clock
};

/// The recent observations of one track, and the code assigned to it. A track owns it; only
/// IdDecoder changes it.
struct BlinkEvidence {
  BlinkWindow window;
  std::vector<Timestamp> pending_dark;  ///< dark frames since the last lit one; they count as
                                        ///< blinking once the track is lit again
  std::vector<std::int16_t> score;      ///< log likelihood of every code in every phase
  std::optional<Timestamp> last_lit;
  std::optional<CodeMatch> assigned;  ///< the decision; empty while undecided
  Timestamp assigned_since{};         ///< over the times that it was hidden, too
  double confidence = 0.0;            ///< posterior probability of `assigned` when it was decided
  double doubt = 0.0;  ///< log odds that another board has blinked here since; at least zero
  /// The same if something hides the light in half of the frames, as a propeller does.
  double obstructed_doubt = 0.0;
  double dark_runs = 0.0;      ///< how often it went dark of late, with fading memory
  bool is_obstructed = false;  ///< more often than any board: a propeller is in front of it
  /// After resume(), `score` contains the earlier sightings, normalized so that the mean likelihood
  /// of all sources is 1. This is the log likelihood of a two-state Markov chain relative to that
  /// mean.
  double earlier_markov = 0.0;
  std::optional<std::size_t> expected;  ///< the code that it was last, if `score` has its phase
  double foretold = 0.0;                ///< posterior probability of `expected` until it is decided
  /// Until then it may be named before it is read. Set where it appears after an absence.
  std::optional<Timestamp> predictable_until;

  /// Returns to the initial state. Allocated memory is kept.
  void forget();
};

/// The last known phase of each board, by index into the library. A board that is out of sight
/// keeps blinking, and its phase can be predicted: two crystals differ by at most 200 ppm.
class PhaseMemory {
 public:
  /// When a code began last, and when that was known.
  struct Phase {
    std::size_t phase = 0;
    Timestamp learned{};
  };

  void update(const CodeMatch& match, Timestamp now);
  [[nodiscard]] std::optional<Phase> of(std::size_t code) const {
    return code < phases_.size() ? phases_[code] : std::nullopt;
  }
  [[nodiscard]] std::size_t size() const { return known_; }

 private:
  std::vector<std::optional<Phase>> phases_;
  std::size_t known_ = 0;
};

/// Maximum-likelihood decoding of cyclic codes with unknown phase, one frame at a time.
///
/// For every code in every phase (steps of about 0.6 ms) it keeps the log likelihood of a sliding
/// window of frames. The alternatives are the other codes and sources that are no boards: lamps on
/// the mains, and a two-state Markov chain of unknown rates for steady and flickering sources. A
/// code is assigned once two posterior probabilities are below their configured limits: that of all
/// other codes (`max_wrong_id`) and that of no board (`max_false_robot`). Afterwards each frame of
/// the track is tested against the assigned code.
class IdDecoder {
 public:
  /// `rate_hz`: frame rate of the camera. `own`: the robot that carries the camera. It sees its own
  /// board in mirrors only, so that ID is never assigned.
  IdDecoder(const IdLibrary& library, const VisionConfig& config, double rate_hz,
            std::optional<RobotId> own = std::nullopt);

  /// The track was lit in the frame at `stamp`, which is later than all before.
  void observe_lit(BlinkEvidence& evidence, Timestamp stamp, const PhaseMemory& known = {}) const;
  /// Nothing was seen where the track is predicted. The frame counts as dark only if the track is
  /// lit again within longest_dark(). Rows of dark frames longer than any code's are ignored,
  /// because the light was hidden. If the track goes dark more often than any code, a blade passes
  /// in front of it, and the first and last frame of each row are ignored as well.
  void observe_dark(BlinkEvidence& evidence, Timestamp stamp) const;
  /// The light of `evidence` was hidden, and one is seen at `now` where it is expected. What it
  /// showed becomes the prior: it is the same light in its phase, or, with probability `stranger`,
  /// any other. It has to be decided anew.
  void resume(BlinkEvidence& evidence, Timestamp now, double stranger) const;
  /// Whether the evidence is worth keeping for resume().
  [[nodiscard]] static bool is_worth_keeping(const BlinkEvidence& evidence);
  /// Stores the phase in `known` if the board has been identified for two periods.
  void update_phase(const BlinkEvidence& evidence, Timestamp now, PhaseMemory& known) const;

  /// The robot whose board the track is; empty while undecided or in doubt.
  [[nodiscard]] std::optional<RobotId> id_of(const BlinkEvidence& evidence) const;
  /// The robot whose board is expected here and blinks as expected so far, while id_of() is still
  /// empty: for 0.3 s after an absence. It is to be read in this time.
  [[nodiscard]] std::optional<RobotId> predicted_id(const BlinkEvidence& evidence,
                                                    Timestamp now) const;
  [[nodiscard]] static bool is_identified(const BlinkEvidence& evidence);
  [[nodiscard]] RobotId code_id(const CodeMatch& match) const { return codes_[match.code].id; }
  /// The index of the robot's code; empty without one.
  [[nodiscard]] std::optional<std::size_t> code_of(RobotId robot) const;
  /// The probability that the assigned board is lit at `stamp`; empty while none is assigned.
  [[nodiscard]] std::optional<double> lit_probability(const BlinkEvidence& evidence,
                                                      Timestamp stamp) const;
  /// The longest dark time of any code of the library, with a margin of six frames.
  [[nodiscard]] Duration longest_dark() const { return longest_dark_; }

 private:
  static constexpr std::size_t kFine = 2;  ///< time resolution: parts of a phase step

  struct Code {
    RobotId id{};
    Duration period{};
    std::size_t phases = 0;
    std::size_t first_score = 0;  ///< its place in BlinkEvidence::score
    double log_share = 0.0;       ///< log prior of the code, all phases together
    std::vector<double> p_lit;    ///< over one period, in fine steps
    /// [lit][fine offset][phase]: log likelihood of one observation. The phases are stored twice in
    /// a row, so that no index has to wrap.
    std::array<std::array<std::vector<std::int16_t>, kFine>, 2> weight;
  };

  [[nodiscard]] static Code make_code(const BlinkCode& blink, double flip_rate);
  void add_code(Code code, double share);
  [[nodiscard]] static std::size_t fine_index(const Code& code, Timestamp stamp);
  [[nodiscard]] static double p_lit(const Code& code, std::size_t phase, Timestamp stamp);
  [[nodiscard]] static std::span<const std::int16_t> scores_of(const BlinkEvidence& evidence,
                                                               const Code& code);
  [[nodiscard]] double log_known(const BlinkEvidence& evidence, std::size_t code, Timestamp now,
                                 const PhaseMemory& known) const;
  void add(BlinkEvidence& evidence, BlinkObservation observation) const;
  void score(BlinkEvidence& evidence, BlinkObservation observation, int sign) const;
  void forget_old(BlinkEvidence& evidence, Timestamp now) const;
  void decide(BlinkEvidence& evidence, Timestamp now, const PhaseMemory& known) const;
  void confirm(BlinkEvidence& evidence, BlinkObservation observation) const;
  void count_dark_run(BlinkEvidence& evidence, Timestamp stamp) const;
  void end_absence(BlinkEvidence& evidence, Timestamp stamp) const;
  [[nodiscard]] static std::int64_t phase_reach(const Code& code, Duration age);
  void expect(BlinkEvidence& evidence, Duration absence) const;
  void summarize(BlinkEvidence& evidence) const;
  [[nodiscard]] double log_evidence(const BlinkEvidence& evidence) const;
  [[nodiscard]] double log_markov(const BlinkEvidence& evidence) const {
    return markov_.log_of(evidence.window.steps()) + evidence.earlier_markov;
  }
  [[nodiscard]] static double doubt_of(const BlinkEvidence& evidence);

  std::vector<Code> codes_;  ///< those of the library, then those of lamps
  std::size_t boards_ = 0;   ///< number of codes of the library
  MarkovLikelihood markov_;
  double max_wrong_id_;
  double max_false_robot_;
  std::optional<std::size_t> own_;
  std::size_t score_count_ = 0;
  Duration window_{};
  Duration longest_dark_{};
  Duration darkness_{};          ///< the same with a margin of two frames
  double most_dark_runs_ = 0.0;  ///< of any board in the clear
};

}  // namespace crepes
