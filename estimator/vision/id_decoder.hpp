/// Identifies the robot's board of a track from the track's on/off history.
#pragma once

#include <cstddef>
#include <optional>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/decoding/blink_window.hpp"
#include "estimator/vision/decoding/phase_memory.hpp"
#include "estimator/vision/decoding/source_models.hpp"
#include "estimator/vision/id_library.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

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
  /// in front of it, and the first and last frame of each row are ignored as well, unless all of
  /// these together show that it is another board.
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
  [[nodiscard]] RobotId code_id(const CodeMatch& match) const {
    return sources_.codes()[match.code].id;
  }
  /// The index of the robot's code; empty without one.
  [[nodiscard]] std::optional<std::size_t> code_of(RobotId robot) const {
    return sources_.code_of(robot);
  }
  /// The probability that the assigned board is lit at `stamp`; empty while none is assigned.
  [[nodiscard]] std::optional<double> lit_probability(const BlinkEvidence& evidence,
                                                      Timestamp stamp) const;
  /// The longest dark time of any code of the library, with a margin of six frames.
  [[nodiscard]] Duration longest_dark() const { return longest_dark_; }

 private:
  void add(BlinkEvidence& evidence, BlinkObservation observation) const;
  void forget_old(BlinkEvidence& evidence, Timestamp now) const;
  void decide(BlinkEvidence& evidence, Timestamp now, const PhaseMemory& known) const;
  void end_absence(BlinkEvidence& evidence, Timestamp stamp) const;
  void review(BlinkEvidence& evidence, Timestamp now) const;
  void read_again(BlinkEvidence& evidence) const;

  SourceModels sources_;
  double max_wrong_id_;
  double max_false_robot_;
  Duration window_{};
  Duration longest_dark_{};
  Duration darkness_{};          ///< the same with a margin of two frames
  double most_dark_runs_ = 0.0;  ///< of any board in the clear
};

}  // namespace crepes
