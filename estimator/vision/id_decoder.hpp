/// A track's on/off history to the robot that blinks it.
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

/// A code of the library at one of its phases.
struct CodeMatch {
  std::size_t code = 0;   ///< index into the library
  std::size_t phase = 0;  ///< in steps of the decoder, against our clock
};

/// What one track showed of late, and what it is taken for. Owned by the track, kept by IdDecoder.
struct BlinkEvidence {
  BlinkWindow window;
  std::vector<Timestamp> pending_dark;  ///< dark since the last lit frame: blinking, or gone
  std::vector<std::int16_t> score;      ///< log likelihood of every code in every phase
  std::optional<Timestamp> last_lit;
  std::optional<CodeMatch> assigned;  ///< who it is
  Timestamp assigned_since{};
  double confidence = 0.0;  ///< posterior of `assigned` when it was given
  double doubt = 0.0;       ///< log odds that another blinks here since, never below zero

  /// Starts anew; keeps its memory.
  void forget();
};

/// Where in its code each board stands, by index into the library. A board keeps its beat while
/// nobody looks at it: crystals differ by at most 100 ppm.
class PhaseMemory {
 public:
  struct Phase {
    std::size_t phase = 0;
    Timestamp learned{};
  };

  void learn(const CodeMatch& match, Timestamp now);
  [[nodiscard]] std::optional<Phase> of(std::size_t code) const {
    return code < phases_.size() ? phases_[code] : std::nullopt;
  }
  [[nodiscard]] std::size_t size() const { return known_; }

 private:
  std::vector<std::optional<Phase>> phases_;
  std::size_t known_ = 0;
};

/// Maximum-likelihood decoding of cyclic codes over their unknown phase, one frame at a time.
///
/// Every code in every phase (steps of about 0.6 ms) keeps the log likelihood of a sliding window.
/// It competes with the other codes and with sources that are no boards: lamps on the mains, and a
/// two-state Markov chain of unknown rates, which covers steady and flickering ones. A code wins as
/// soon as the posterior of all others and of no board are below what the configuration allows. Its
/// own frames are then tested against it for as long as the track lives.
class IdDecoder {
 public:
  /// `rate_hz`: the camera's. `own`: the robot that looks; it sees itself in mirrors only, and its
  /// ID is never given.
  IdDecoder(const IdLibrary& library, const VisionConfig& config, double rate_hz,
            std::optional<RobotId> own = std::nullopt);

  /// The track's board was lit at `stamp`, later than all before.
  void observe_lit(BlinkEvidence& evidence, Timestamp stamp, const PhaseMemory& known = {}) const;
  /// Nothing was seen where the track's board is. Counts once it is lit again soon enough.
  void observe_dark(BlinkEvidence& evidence, Timestamp stamp) const;
  /// Remembers the phase of a board that has been identified for long enough.
  void learn(const BlinkEvidence& evidence, Timestamp now, PhaseMemory& known) const;

  /// Who it is; empty while undecided or in doubt.
  [[nodiscard]] std::optional<RobotId> id_of(const BlinkEvidence& evidence) const;
  [[nodiscard]] static bool is_identified(const BlinkEvidence& evidence);
  [[nodiscard]] RobotId code_id(const CodeMatch& match) const { return codes_[match.code].id; }
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
    std::size_t phases = 0;
    std::size_t first_score = 0;  ///< its place in BlinkEvidence::score
    double log_share = 0.0;       ///< how likely it is beforehand, all phases together
    std::vector<double> p_lit;    ///< over one period, in fine steps
    /// [lit][fine offset][phase], the phases twice in a row: log likelihood of one observation.
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

  std::vector<Code> codes_;  ///< the library's, then lamps
  std::size_t boards_ = 0;   ///< of them the library's
  MarkovLikelihood markov_;
  double max_wrong_id_;
  double max_false_robot_;
  std::optional<std::size_t> own_;
  std::size_t score_count_ = 0;
  Duration window_{};
  Duration longest_dark_{};
};

}  // namespace crepes
