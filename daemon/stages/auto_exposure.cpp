#include "daemon/stages/auto_exposure.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace crepes {
namespace {

using std::chrono::milliseconds;

constexpr Duration kWindow = milliseconds{500};  // boards are lit several times in it
constexpr Duration kTrial = milliseconds{1500};  // an ID is read in less
constexpr Duration kTrialPeriod = milliseconds{15000};

// Gray levels.
constexpr double kWhite = 250.0;   // and brighter: how bright is unknown
constexpr double kDim = 180.0;     // a brightest board below this has room
constexpr double kTarget = 215.0;  // for the brightest board
constexpr double kMargin = 20.0;   // of the faintest board above the threshold
constexpr double kBright = 60.0;   // a background that leaves boards no room

constexpr double kStep = 1.25;         // the most that the exposure changes at once
constexpr double kLeastChange = 0.02;  // less is noise
constexpr double kLongToShort = 32.0;

}  // namespace

AutoExposure::AutoExposure(const LightSettings& settings)
    : is_active_(settings.exposure == ExposureControl::kAuto && settings.light.exposure_us),
      longest_us_(settings.light.exposure_us.value_or(0.0)),
      exposure_us_(longest_us_) {}

void AutoExposure::add(std::span<const Bearing> boards) {
  for (const Bearing& board : boards) {
    double& peak = peaks_[board.neighbor];
    peak = std::max(peak, board.peak);
  }
}

std::optional<double> AutoExposure::step(Timestamp now, const PictureLevels& levels) {
  if (!window_end_) {
    next_trial_ = now + kTrialPeriod;
    window_end_ = now + kWindow;
  }
  if (!is_active_) peaks_.clear();
  if (!is_active_ || now < *window_end_) return std::nullopt;
  const double wanted = next_exposure(now, levels);
  peaks_.clear();
  const double before = std::exchange(exposure_us_, wanted);
  const bool is_same = std::abs(wanted - before) <= kLeastChange * before;
  if (is_same) exposure_us_ = before;
  return is_same ? std::nullopt : std::optional(wanted);
}

std::optional<double> AutoExposure::exposure_us() const {
  return is_active_ ? std::optional(exposure_us_) : std::nullopt;
}

/// At the end of a window, and begins the next.
double AutoExposure::next_exposure(Timestamp now, const PictureLevels& levels) {
  window_end_ = now + kWindow;
  const double shortest_us = longest_us_ / kLongToShort;
  if (resumed_us_) {
    next_trial_ = now + kTrialPeriod;
    const double before = *std::exchange(resumed_us_, std::nullopt);
    if (peaks_.empty()) return longest_us_;
    return std::clamp(exposure_us_ * least_factor(levels), before, longest_us_);
  }
  if (now >= next_trial_ && exposure_us_ < longest_us_ && levels.background < kBright) {
    window_end_ = now + kTrial;
    resumed_us_ = exposure_us_;
    return longest_us_;
  }
  return std::clamp(exposure_us_ * factor(levels), shortest_us, longest_us_);
}

/// By which the exposure is to change.
double AutoExposure::factor(const PictureLevels& levels) const {
  if (levels.background >= kBright) return 1.0 / kStep;
  if (peaks_.empty()) return kStep;  // those who come are far
  double brightest = 0.0;
  for (const auto& [robot, peak] : peaks_) brightest = std::max(brightest, peak);
  double wanted = 1.0;
  if (brightest >= kWhite) {
    wanted = 1.0 / kStep;
  } else if (brightest < kDim) {
    wanted = (kTarget - levels.background) / (brightest - levels.background);
  }
  return std::clamp(std::max(wanted, least_factor(levels)), 1.0 / kStep, kStep);
}

/// By which it must be multiplied, or more, for the faintest board; 0 if there is none, or if even
/// the faintest is white. Light above the background is proportional to the exposure.
double AutoExposure::least_factor(const PictureLevels& levels) const {
  double faintest = kWhite;
  for (const auto& [robot, peak] : peaks_) faintest = std::min(faintest, peak);
  if (faintest >= kWhite) return 0.0;
  const double least = levels.threshold + kMargin - levels.background;
  return least / std::max(1.0, faintest - levels.background);
}

}  // namespace crepes
