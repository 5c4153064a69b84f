#include "estimator/vision/decoding/code_model.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/core/crystal_skew.hpp"
#include "estimator/vision/decoding/phase_scores.hpp"

namespace crepes {
namespace {

constexpr Duration kPhaseStep = std::chrono::microseconds{625};
constexpr std::size_t kMinPhases = 8;
constexpr std::size_t kMaxPhases = 320;
/// Half an exposure: with an edge within, both states are possible.
constexpr Duration kEdgeBlur = std::chrono::microseconds{500};
constexpr Duration kPhaseError = std::chrono::microseconds{2500};

}  // namespace

CodeModel CodeModel::from(const BlinkCode& blink, double flip_rate) {
  CodeModel code;
  code.period = blink.period();
  code.phases = std::clamp<std::size_t>(static_cast<std::size_t>(code.period / kPhaseStep),
                                        kMinPhases, kMaxPhases);
  code.slots = blink.slots();
  code.flip_rate = flip_rate;
  const std::size_t steps = code.phases * kFine;
  const auto step_count = static_cast<std::int64_t>(steps);
  // A step represents all phases and times that are rounded to it.
  const Duration spread =
      code.period * 3 / (4 * static_cast<std::int64_t>(code.phases)) + kEdgeBlur;
  code.edge_blur = to_seconds(spread) / to_seconds(code.period);
  for (std::int64_t i = 0; i < step_count; ++i) {
    const Duration t = code.period * (2 * i + 1) / (2 * step_count);
    const double lit = blink.lit_fraction(t - spread, t + spread);
    code.p_lit.push_back(flip_rate + (1.0 - 2.0 * flip_rate) * lit);
  }
  for (const std::size_t lit : {0U, 1U}) {
    for (std::size_t offset = 0; offset < kFine; ++offset) {
      for (std::size_t k = 0; k < 2 * code.phases; ++k) {
        const double p = code.p_lit[(k * kFine + offset) % steps];
        code.weight[lit][offset].push_back(to_units(std::log(lit != 0 ? p : 1.0 - p)));
      }
    }
  }
  return code;
}

double CodeModel::lit_probability(std::size_t phase, Timestamp stamp) const {
  return p_lit[(fine_index(stamp) + phase * kFine) % p_lit.size()];
}

std::int64_t CodeModel::phase_reach(Duration age) const {
  const Duration error = kPhaseError + from_seconds(kMaxSkew * to_seconds(age));
  return error * static_cast<std::int64_t>(phases) / period + 1;
}

}  // namespace crepes
