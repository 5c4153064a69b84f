#include "estimator/vision/decoding/source_models.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr double kMinFlipRate = 0.02;  // with less, a single frame would count too much
constexpr double kMaxFlipRate = 0.3;

// Lamps on the mains flash once or twice a cycle. A camera can hardly distinguish finer steps of
// duty.
constexpr std::array kLampRatesHz{50.0, 60.0, 100.0, 120.0};
constexpr std::array kLampDuties{0.1, 0.25, 0.4, 0.55, 0.7, 0.85};

void add_scaled(std::span<std::int16_t> sum, const std::int16_t* weight, int sign) {
  if (sign > 0) {
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] = static_cast<std::int16_t>(sum[i] + weight[i]);
  } else {
    for (std::size_t i = 0; i < sum.size(); ++i)
      sum[i] = static_cast<std::int16_t>(sum[i] - weight[i]);
  }
}

}  // namespace

SourceModels::SourceModels(const IdLibrary& library, double flip_rate, std::optional<RobotId> own)
    : boards_(library.entries().size()) {
  const double flips = std::clamp(flip_rate, kMinFlipRate, kMaxFlipRate);
  for (const auto& [id, blink] : library.entries()) {
    if (id == own) own_ = codes_.size();
    const double share = id == own ? kMirrorShare : 1.0;
    add_code(CodeModel::from(blink, flips), share / static_cast<double>(boards_));
    codes_.back().id = id;
  }
  constexpr double kShare =
      kLampOdds / static_cast<double>(kLampRatesHz.size() * kLampDuties.size());
  for (const double hz : kLampRatesHz) {
    for (const double duty : kLampDuties) {
      const auto lamp = BlinkCode::from_duty(duty, from_seconds(1.0 / hz));
      CREPES_EXPECT(lamp.has_value(), "duties of lamps lie between 0 and 1");
      add_code(CodeModel::from(*lamp, flips), kShare);
    }
  }
}

void SourceModels::add_code(CodeModel code, double share) {
  code.first_score = score_count_;
  score_count_ += code.phases;
  code.log_share = std::log(share);
  codes_.push_back(std::move(code));
}

std::optional<std::size_t> SourceModels::code_of(RobotId robot) const {
  const auto found = std::ranges::find(boards(), robot, &CodeModel::id);
  if (found == boards().end()) return std::nullopt;
  return static_cast<std::size_t>(found - boards().begin());
}

void SourceModels::score(BlinkEvidence& evidence, BlinkObservation observation, int sign) const {
  const std::size_t first = evidence.assigned ? evidence.assigned->code : 0;
  const std::size_t end = evidence.assigned ? first + 1 : codes_.size();
  for (std::size_t c = first; c < end; ++c) {
    const CodeModel& code = codes_[c];
    const std::size_t fine = code.fine_index(observation.stamp);
    const auto& weight = code.weight[observation.lit ? 1 : 0][fine % CodeModel::kFine];
    add_scaled(std::span(evidence.score).subspan(code.first_score, code.phases),
               weight.data() + fine / CodeModel::kFine, sign);
  }
}

}  // namespace crepes
