#include "drivers/camera/frame_health.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace crepes {
namespace {

/// Copies every `step`th row of the image to `kept`. Returns whether they were equal before.
bool replace_rows(const Frame& frame, int step, std::vector<std::uint8_t>& kept) {
  const auto width = static_cast<std::size_t>(frame.width);
  const auto rows = static_cast<std::size_t>((frame.height + step - 1) / step);
  bool same = kept.size() == rows * width;
  kept.resize(rows * width);
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint8_t* row = frame.data() + frame.stride() * static_cast<std::ptrdiff_t>(i) * step;
    const auto old = kept.begin() + static_cast<std::ptrdiff_t>(i * width);
    if (same && std::equal(row, row + width, old)) continue;
    same = false;
    std::copy(row, row + width, old);
  }
  return same;
}

/// Whether enough pixels are between black and white for noise to be visible.
bool must_be_noisy(const std::vector<std::uint8_t>& pixels) {
  constexpr std::uint8_t kBlack = 8;
  constexpr std::uint8_t kWhite = 250;
  constexpr std::ptrdiff_t kEnough = 64;
  return std::ranges::count_if(pixels, [](std::uint8_t p) { return p >= kBlack && p <= kWhite; }) >=
         kEnough;
}

std::string size_of(int width, int height) { return fmt::format("[{}, {}]", width, height); }

}  // namespace

FrameHealth::FrameHealth(const CameraConfig& config)
    : resolution_(config.calibration.resolution),
      rate_hz_(config.calibration.rate_hz),
      is_free_running_(config.device.trigger == CameraTrigger::kFree),
      mean_gap_s_(1.0 / config.calibration.rate_hz) {}

Result<void> FrameHealth::check(const Frame& frame) {
  constexpr Duration kLongest = std::chrono::seconds(1);
  if (frame.width != resolution_[0] || frame.height != resolution_[1]) {
    return fail(ErrorCode::kFormat, fmt::format("frames of {} instead of resolution {}",
                                                size_of(frame.width, frame.height),
                                                size_of(resolution_[0], resolution_[1])));
  }
  if (last_stamp_) record_interval(frame.stamp - *last_stamp_);
  last_stamp_ = frame.stamp;
  if (!repeats_the_last(frame)) unchanged_since_ = frame.stamp;
  if (frame.stamp - unchanged_since_ < kLongest || !must_be_noisy(all_rows_)) return {};
  return fail(ErrorCode::kIo, "the picture is frozen: the camera hangs");
}

/// Sensor noise always changes some pixel. Some rows are enough to see it. The whole image is
/// compared only if those rows are clipped to black.
bool FrameHealth::repeats_the_last(const Frame& frame) {
  constexpr int kGlance = 16;
  if (!replace_rows(frame, kGlance, some_rows_)) {
    all_rows_.clear();
    return false;
  }
  return replace_rows(frame, 1, all_rows_);
}

void FrameHealth::record_interval(Duration gap) {
  constexpr double kMemory = 0.02;
  constexpr double kLongestGap = 10.0;  // periods: longer gaps say nothing about the rate
  mean_gap_s_ += kMemory * (std::min(to_seconds(gap), kLongestGap / rate_hz_) - mean_gap_s_);
  ++gaps_;
}

std::optional<std::string> FrameHealth::diagnosis() const {
  constexpr double kFirstJudgment = 1.0;  // s
  if (!is_free_running_ || static_cast<double>(gaps_) < kFirstJudgment * rate_hz_ / 2.0)
    return std::nullopt;
  const double periods = mean_gap_s_ * rate_hz_;
  if (periods > 1.25) {
    return "fewer frames a second than rate_hz: a long exposure, a slow link or lost frames; see "
           "the counters, or set rate_hz";
  }
  if (periods < 0.8) return "more frames a second than rate_hz; set rate_hz";
  return std::nullopt;
}

}  // namespace crepes
