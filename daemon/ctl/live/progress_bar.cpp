#include "daemon/ctl/live/progress_bar.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace crepes {

std::string rough_time(double seconds) {
  constexpr long kMinute = 60;
  constexpr long kHour = 60 * kMinute;
  const long whole = std::lround(seconds);
  if (whole < kMinute) return fmt::format("{} s", whole);
  if (whole < kHour) return fmt::format("{} min {} s", whole / kMinute, whole % kMinute);
  return fmt::format("{} h {} min", whole / kHour, whole % kHour / kMinute);
}

std::string ProgressBar::text(double share, Timestamp now) const {
  constexpr std::size_t kCells = 40;
  constexpr double kFirstGuess = 1.0;  // s
  share = std::clamp(share, 0.0, 1.0);
  const auto full = static_cast<std::size_t>(share * static_cast<double>(kCells));
  const std::string bar = std::string(full, '#') + std::string(kCells - full, '.');
  const double elapsed_s = to_seconds(now - start_);
  const bool is_guessed = elapsed_s >= kFirstGuess && share > 0.0;
  return fmt::format(
      "[{}] {:3.0f} %{}", bar, std::floor(100.0 * share),
      is_guessed ? ", " + rough_time(elapsed_s * (1.0 - share) / share) + " left" : "");
}

}  // namespace crepes
