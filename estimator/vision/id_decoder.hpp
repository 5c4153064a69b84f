/// A track's on/off history to the robot that blinks it.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {

/// What one track showed of late, and what it is taken for. Owned by the track, kept by IdDecoder.
struct BlinkEvidence {
  struct Observation {
    Timestamp stamp{};
    bool lit = false;
  };
  struct Match {
    std::size_t code = 0;  ///< index into the library
    std::size_t phase = 0;
  };

  std::deque<Observation> window;             ///< in time order
  std::vector<Timestamp> pending_dark;        ///< dark since the last lit frame: blinking, or gone
  std::vector<std::int16_t> score;            ///< log likelihood of every code in every phase
  std::array<std::array<int, 2>, 2> steps{};  ///< [lit before][lit now]: counts within the window
  std::optional<Timestamp> last_lit;
  Timestamp resumed{};            ///< since when it has been seen without a break
  std::optional<Match> assigned;  ///< who it is
  double confidence = 0.0;        ///< posterior of `assigned`
  bool is_doubted = false;        ///< lately it did not blink as `assigned` should
};

/// Maximum-likelihood decoding of cyclic codes over their unknown phase, one frame at a time.
///
/// Every code in every phase (steps of about 0.6 ms) keeps the log likelihood of a sliding window.
/// It competes with the other codes and with a source that is no board: a two-state Markov chain
/// of unknown rates, which covers steady, flickering and alternating lamps. The winner is given
/// when its posterior is high and at least one whole period was seen; it is checked against the
/// last period at every frame from then on.
class IdDecoder {
 public:
  /// `flip_rate`: part of the frames that show the wrong state; an ID needs `min_confidence`.
  IdDecoder(const IdLibrary& library, double flip_rate, double min_confidence);

  /// The track's board was lit at `stamp`, later than all before.
  void observe_lit(BlinkEvidence& evidence, Timestamp stamp) const;
  /// Nothing was seen where the track's board is. Counts once it is lit again soon enough.
  void observe_dark(BlinkEvidence& evidence, Timestamp stamp) const;

  /// Who it is; empty while undecided or in doubt.
  [[nodiscard]] static bool is_identified(const BlinkEvidence& evidence) {
    return evidence.assigned.has_value() && !evidence.is_doubted;
  }
  [[nodiscard]] std::optional<RobotId> id_of(const BlinkEvidence& evidence) const;
  [[nodiscard]] RobotId code_id(const BlinkEvidence::Match& match) const {
    return codes_[match.code].id;
  }
  /// The probability that an assigned board is lit at `stamp`; empty for others.
  [[nodiscard]] std::optional<double> lit_probability(const BlinkEvidence& evidence,
                                                      Timestamp stamp) const;
  /// A board is never dark for longer, frames at the edges included.
  [[nodiscard]] Duration longest_dark() const { return longest_dark_; }

 private:
  static constexpr std::size_t kFine = 2;  ///< time resolution: parts of a phase step

  struct Code {
    RobotId id{};
    Duration period{};
    Duration check_span{};  ///< whole periods, at least 150 ms
    std::size_t phases = 0;
    std::size_t first_score = 0;  ///< its place in BlinkEvidence::score
    std::vector<double> p_lit;    ///< over one period, in fine steps
    /// [lit][fine offset][phase], the phases twice in a row: log likelihood of one observation.
    std::array<std::array<std::vector<std::int16_t>, kFine>, 2> weight;
  };
  struct Best {
    BlinkEvidence::Match match;
    double posterior = 0.0;
  };

  [[nodiscard]] static std::size_t fine_index(const Code& code, Timestamp stamp);
  [[nodiscard]] static double p_lit(const Code& code, std::size_t phase, Timestamp stamp);
  void add(BlinkEvidence& evidence, BlinkEvidence::Observation observation) const;
  void score(BlinkEvidence& evidence, BlinkEvidence::Observation observation, int sign) const;
  void forget_old(BlinkEvidence& evidence, Timestamp now) const;
  [[nodiscard]] Best best_of(const BlinkEvidence& evidence) const;
  [[nodiscard]] double log_markov(const BlinkEvidence& evidence) const;
  void judge(BlinkEvidence& evidence, Timestamp now) const;

  std::vector<Code> codes_;
  std::vector<double> log_gamma_half_;  ///< ln Gamma(n + 1/2)
  std::vector<double> log_factorial_;   ///< ln n!
  double flip_rate_;
  double min_confidence_;
  std::size_t score_count_ = 0;
  Duration window_{};
  Duration longest_dark_{};
};

}  // namespace crepes
