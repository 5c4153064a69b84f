/// What a light may be: a board of the library, a lamp, or a source that is steady or flickers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/vision/decoding/blink_evidence.hpp"
#include "estimator/vision/decoding/blink_window.hpp"
#include "estimator/vision/decoding/code_model.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {

/// The likelihoods of all kinds of sources, with their priors: odds or shares relative to a board
/// of the library in any phase. Lamps on the mains are codes, too. All other sources are a
/// two-state Markov chain of unknown rates.
class SourceModels {
 public:
  static constexpr double kMarkovOdds = 1.0;    ///< a source that changes like a Markov chain
  static constexpr double kLampOdds = 1.0;      ///< a lamp on the mains
  static constexpr double kMirrorShare = 0.01;  ///< the observer's own board in a mirror

  /// `flip_rate`: share of the frames that show the wrong state. `own`: the robot that carries the
  /// camera.
  SourceModels(const IdLibrary& library, double flip_rate, std::optional<RobotId> own);

  /// Those of the library, then those of lamps.
  [[nodiscard]] std::span<const CodeModel> codes() const { return codes_; }
  [[nodiscard]] std::span<const CodeModel> boards() const { return codes().first(boards_); }
  [[nodiscard]] std::span<const CodeModel> lamps() const { return codes().subspan(boards_); }
  /// The code of the observer's own board.
  [[nodiscard]] std::optional<std::size_t> own() const { return own_; }
  /// The index of the robot's code; empty without one.
  [[nodiscard]] std::optional<std::size_t> code_of(RobotId robot) const;

  /// The scores of `code` in `evidence`, which must have scores.
  [[nodiscard]] static PhaseScores scores_of(const BlinkEvidence& evidence, const CodeModel& code) {
    return PhaseScores(evidence.score).subspan(code.first_score, code.phases);
  }
  /// The log likelihood of the Markov chain.
  [[nodiscard]] double log_markov(const BlinkEvidence& evidence) const {
    return markov_.log_of(evidence.window.steps()) + evidence.earlier_markov;
  }

  /// Sets all scores of `evidence` to `score`.
  void fill_scores(BlinkEvidence& evidence, std::int16_t score) const {
    evidence.score.assign(score_count_, score);
  }
  /// Adds (`sign` 1) or removes (-1) an observation: for all codes while undecided, afterwards for
  /// the assigned code only.
  void score(BlinkEvidence& evidence, BlinkObservation observation, int sign) const;

 private:
  void add_code(CodeModel code, double share);

  std::vector<CodeModel> codes_;
  std::size_t boards_ = 0;
  std::size_t score_count_ = 0;
  std::optional<std::size_t> own_;
  MarkovLikelihood markov_;
};

}  // namespace crepes
