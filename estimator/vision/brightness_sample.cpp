#include "estimator/vision/brightness_sample.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace crepes {
namespace {

constexpr int kRows = 16;
constexpr int kPixelStep = 9;  // columns; odd, against pictures that repeat every second or fourth
constexpr int kMinContrast = 16;       // gray levels above the background
constexpr double kSpreadSigmas = 8.0;  // noise above the background
constexpr double kDarkShare = 0.05;    // a part smaller than this is no background
constexpr double kFaintSigmas = 3.7;   // of noise; white Gaussian noise is above in 1 pixel of 10^4
constexpr int kFaintContrast = 2;      // gray levels, where there is no noise

}  // namespace

BrightnessSample::BrightnessSample(const GrayImage& image) {
  // Two histograms: equal neighbors would wait for each other's increments.
  std::array<int, 256> even{};
  std::array<int, 256> odd{};
  const int row_step = std::max(1, image.height / kRows);
  for (int v = row_step / 2; v < image.height; v += row_step) {
    const std::uint8_t* row = image.row(v);
    int u = 0;
    for (; u + kPixelStep < image.width; u += 2 * kPixelStep) {
      ++even[row[u]];
      ++odd[row[u + kPixelStep]];
    }
    if (u < image.width) ++even[row[u]];
  }
  for (std::size_t i = 0; i < even.size(); ++i) below_[i + 1] = below_[i] + even[i] + odd[i];
}

/// The level that `part` of the samples from `first` to `last` are below.
int BrightnessSample::quantile(int first, int last, double part) const {
  const int before = below_[static_cast<std::size_t>(first)];
  const double wanted = before + part * (below_[static_cast<std::size_t>(last) + 1] - before);
  const auto* const above =
      std::upper_bound(below_.begin() + first + 1, below_.begin() + last + 1, wanted);
  return std::min(last, static_cast<int>(above - below_.begin()) - 1);
}

/// The same between gray levels: each is as wide as one.
double BrightnessSample::exact_quantile(int first, int last, double part) const {
  const int level = quantile(first, last, part);
  const int before = below_[static_cast<std::size_t>(first)];
  const double wanted = before + part * (below_[static_cast<std::size_t>(last) + 1] - before);
  const int below = below_[static_cast<std::size_t>(level)];
  const int here = below_[static_cast<std::size_t>(level) + 1] - below;
  return level - 0.5 + (wanted - below) / std::max(1, here);
}

/// Where noise is rare. The upper half and its tail count: black clips the lower half, and texture
/// shows in the tail.
int BrightnessSample::faint_from(int first, int last) const {
  const double middle = exact_quantile(first, last, 0.5);
  const double sigma = std::max(exact_quantile(first, last, 0.841) - middle,
                                (exact_quantile(first, last, 0.99) - middle) / 2.326);
  return static_cast<int>(
      std::ceil(middle + std::max<double>(kFaintContrast, kFaintSigmas * sigma)));
}

double BrightnessSample::share_from(int level) const {
  const int all = below_.back();
  return static_cast<double>(all - below_[static_cast<std::size_t>(level)]) / std::max(1, all);
}

Background BrightnessSample::darkest_from(int level) const {
  // From the darkest pixels upwards, until what belongs to the part no longer changes.
  constexpr int kMaxRounds = 8;
  Background part;
  int last = std::min(255, quantile(level, 255, kDarkShare) + kMinContrast);
  for (int round = 0; round < kMaxRounds; ++round) {
    part.median = quantile(level, last, 0.5);
    const double sigma = (quantile(level, last, 0.841) - quantile(level, last, 0.159)) / 2.0;
    part.threshold =
        part.median + std::max(kMinContrast, static_cast<int>(std::ceil(kSpreadSigmas * sigma)));
    const int previous = std::exchange(last, std::min(255, part.threshold - 1));
    if (last == previous) break;
  }
  part.faint = faint_from(level, last);
  part.threshold = std::min(part.threshold, kHighestThreshold);
  part.faint = std::min(part.faint, part.threshold);
  return part;
}

}  // namespace crepes
