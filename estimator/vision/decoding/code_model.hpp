/// A blink code in all of its phases: how likely it is lit in a frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "estimator/core/measurements.hpp"
#include "estimator/core/time.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {

/// The likelihoods of observations under one code, for every phase against our clock.
struct CodeModel {
  static constexpr std::size_t kFine = 2;  ///< time resolution: parts of a phase step

  RobotId id{};  ///< of a board
  Duration period{};
  std::size_t slots = 0;        ///< of a pattern; zero for a duty
  double flip_rate = 0.0;       ///< share of the frames that show the wrong state
  double edge_blur = 0.0;       ///< so far from an edge both states are possible, in periods
  std::size_t phases = 0;       ///< steps of about 0.6 ms
  std::size_t first_score = 0;  ///< its place in BlinkEvidence::score
  double log_share = 0.0;       ///< log prior of the code, all phases together
  std::vector<double> p_lit;    ///< over one period, in fine steps
  /// [lit][fine offset][phase]: log likelihood of one observation, in units of a score. The phases
  /// are stored twice in a row, so that no index has to wrap.
  std::array<std::array<std::vector<std::int16_t>, kFine>, 2> weight;

  /// Without id, first_score and log_share.
  [[nodiscard]] static CodeModel from(const BlinkCode& blink, double flip_rate);

  /// Where `stamp` lies within the period of a code in phase 0, from 0 to 1.
  [[nodiscard]] double part_of_period(Timestamp stamp) const {
    return static_cast<double>(within_period(stamp)) / static_cast<double>(period.count());
  }
  /// The fine step of `stamp` within the period of a code in phase 0.
  [[nodiscard]] std::size_t fine_index(Timestamp stamp) const {
    return static_cast<std::size_t>(within_period(stamp) *
                                    static_cast<std::int64_t>(phases * kFine) / period.count());
  }
  /// The probability that the code is lit at `stamp` if it has this phase.
  [[nodiscard]] double lit_probability(std::size_t phase, Timestamp stamp) const;
  /// So many steps a phase may be off that was known `age` ago.
  [[nodiscard]] std::int64_t phase_reach(Duration age) const;

 private:
  [[nodiscard]] std::int64_t within_period(Timestamp stamp) const {
    return ((to_ns(stamp) % period.count()) + period.count()) % period.count();
  }
};

}  // namespace crepes
