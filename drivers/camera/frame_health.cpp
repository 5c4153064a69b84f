#include "drivers/camera/frame_health.hpp"

#include <algorithm>

namespace crepes {
namespace {

/// Copies every `step`th row of the picture over `kept`; whether they were there already.
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

/// Whether enough pixels are between black and white for noise to show.
bool must_be_noisy(const std::vector<std::uint8_t>& pixels) {
  constexpr std::uint8_t kBlack = 8;
  constexpr std::uint8_t kWhite = 250;
  constexpr std::ptrdiff_t kEnough = 64;
  return std::ranges::count_if(pixels, [](std::uint8_t p) { return p >= kBlack && p <= kWhite; }) >=
         kEnough;
}

std::string size_of(int width, int height) {
  return "[" + std::to_string(width) + ", " + std::to_string(height) + "]";
}

}  // namespace

FrameHealth::FrameHealth(const CameraConfig& config)
    : resolution_(config.resolution),
      rate_hz_(config.rate_hz),
      is_free_running_(config.trigger == CameraTrigger::kFree),
      mean_gap_s_(1.0 / config.rate_hz) {}

Result<void> FrameHealth::check(const Frame& frame) {
  constexpr Duration kLongest = std::chrono::seconds(1);
  if (frame.width != resolution_[0] || frame.height != resolution_[1]) {
    return fail(ErrorCode::kFormat, "frames of " + size_of(frame.width, frame.height) +
                                        " instead of resolution " +
                                        size_of(resolution_[0], resolution_[1]));
  }
  if (last_stamp_) note_gap(frame.stamp - *last_stamp_);
  last_stamp_ = frame.stamp;
  if (!repeats_the_last(frame)) unchanged_since_ = frame.stamp;
  if (frame.stamp - unchanged_since_ < kLongest || !must_be_noisy(all_rows_)) return {};
  return fail(ErrorCode::kIo, "the picture is frozen: the camera hangs");
}

/// A sensor's noise turns some pixel over. A glance at some rows is enough to see it; only a
/// picture where those are clipped to black is looked at as a whole.
bool FrameHealth::repeats_the_last(const Frame& frame) {
  constexpr int kGlance = 16;
  if (!replace_rows(frame, kGlance, some_rows_)) {
    all_rows_.clear();
    return false;
  }
  return replace_rows(frame, 1, all_rows_);
}

void FrameHealth::note_gap(Duration gap) {
  constexpr double kMemory = 0.02;
  constexpr double kLongestGap = 10.0;  // periods: one that is longer is no matter of rate
  mean_gap_s_ += kMemory * (std::min(to_seconds(gap), kLongestGap / rate_hz_) - mean_gap_s_);
  ++gaps_;
}

std::optional<std::string> FrameHealth::diagnosis() const {
  constexpr double kFirstLook = 1.0;  // s
  if (!is_free_running_ || static_cast<double>(gaps_) < kFirstLook * rate_hz_ / 2.0)
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
