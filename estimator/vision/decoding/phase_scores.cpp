#include "estimator/vision/decoding/phase_scores.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {

std::int16_t to_units(double nats) {
  return static_cast<std::int16_t>(std::lround(kUnitsPerNat * nats));
}

std::int16_t highest_score(PhaseScores scores) {
  std::int16_t best = scores[0];
  for (const std::int16_t s : scores) best = std::max(best, s);
  return best;
}

double log_mean(PhaseScores scores, std::int16_t top) {
  const auto nearly = static_cast<std::int16_t>(top - kUnitsPerNat);
  std::int16_t like_top = 0;
  for (const std::int16_t s : scores)
    like_top = static_cast<std::int16_t>(like_top + (s >= nearly ? 1 : 0));
  return top / kUnitsPerNat +
         std::log(static_cast<double>(like_top) / static_cast<double>(scores.size()));
}

std::size_t best_phase(PhaseScores scores) {
  const std::size_t n = scores.size();
  const std::int16_t top = highest_score(scores);
  const auto at =
      static_cast<std::size_t>(std::find(scores.begin(), scores.end(), top) - scores.begin());
  std::size_t after = 0;
  std::size_t before = 0;
  while (after + 1 < n && scores[(at + after + 1) % n] == top) ++after;
  while (before + after + 1 < n && scores[(at + n - before - 1) % n] == top) ++before;
  return (at + n - before + (before + after) / 2) % n;
}

}  // namespace crepes
