/// The scores of one code: a log likelihood for each of its phases, as 16-bit integers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace crepes {

/// Units of a score in one nat. A full window of the least likely frames fits 16 bits.
inline constexpr double kUnitsPerNat = 24.0;

/// The scores of a code, by phase; at least one.
using PhaseScores = std::span<const std::int16_t>;

/// The nearest score to a log likelihood.
[[nodiscard]] std::int16_t to_units(double nats);

[[nodiscard]] std::int16_t highest_score(PhaseScores scores);

/// The log of the mean likelihood over all phases, approximated [nats]: the best score, times the
/// share of phases within a nat of it. `top` is the highest score.
[[nodiscard]] double log_mean(PhaseScores scores, std::int16_t top);

/// The middle of the run of phases that share the best score.
[[nodiscard]] std::size_t best_phase(PhaseScores scores);

}  // namespace crepes
