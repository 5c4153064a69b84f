#include "estimator/swarm/range_screen.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

// Of the share of late ranges: the weight of one range, and the time after which few ranges count.
constexpr double kLateMemory = 1.0 / 16.0;
constexpr double kLateMemoryTime = 0.3;  // s
constexpr double kHiddenShare = 0.25;    // fewer ranges are late in line of sight

// The usual gap is that of so many ranges. Unusual ones do not change it.
constexpr int kGapMemory = 256;
constexpr int kLeastGaps = 16;
constexpr double kUsualDeviations = 2.0;
constexpr double kSurelyUsual = 1.0 / 3.0;  // of the gap of late ranges
constexpr double kMostUsual = 0.9;
constexpr double kAlmostLate_m = 1.0;  // one sigma of the error just below that gap
// The doubt about ranges fades within this time. Less than this is chance, in line of sight.
constexpr double kDoubtTime = 0.5;  // s
constexpr double kLeastDoubt = 0.05;

}  // namespace

void RangeScreen::UsualGap::add(double gap_db) {
  if (!std::isfinite(gap_db)) return;
  count = std::min(count + 1, kGapMemory);
  deviation_db += (std::abs(gap_db - mean_db) - deviation_db) / count;
  mean_db += (gap_db - mean_db) / count;
}

double RangeScreen::UsualGap::most_db(double late_path_db) const {
  const double least_db = kSurelyUsual * late_path_db;
  if (count < kLeastGaps) return least_db;
  return std::clamp(mean_db + kUsualDeviations * deviation_db, least_db, kMostUsual * late_path_db);
}

std::optional<RangeReading> RangeScreen::accept(const UwbRange& range,
                                                const FilterSettings& settings) {
  const bool is_plausible = range.range_m > 0.0 && range.range_m <= settings.max_range_m;
  const double gap_db = range.received_dbm - range.first_path_dbm;
  const bool is_late = gap_db > settings.late_path_db;
  const double passed_s =
      latest_ ? std::max(0.0, to_seconds(range.stamp - *latest_)) : kLateMemoryTime * 1e3;
  const double weight = std::max(kLateMemory, 1.0 - std::exp(-passed_s / kLateMemoryTime));
  late_share_ += weight * ((is_late ? 1.0 : 0.0) - late_share_);
  latest_ = latest_ ? std::max(*latest_, range.stamp) : range.stamp;
  if (!is_plausible || is_late || late_share_ > kHiddenShare) return std::nullopt;
  const double usual_db = usual_.most_db(settings.late_path_db);
  if (usual_.count < kLeastGaps || gap_db <= usual_db) usual_.add(gap_db);
  const double unusual = std::max(0.0, (gap_db - usual_db) / (settings.late_path_db - usual_db));
  if (usual_.count >= kLeastGaps)
    doubt_ += (1.0 - std::exp(-passed_s / kDoubtTime)) * (unusual - doubt_);
  const double doubt = std::max(unusual, doubt_ > kLeastDoubt ? doubt_ : 0.0);
  return RangeReading{range.range_m, settings.range_sigma_m, kAlmostLate_m * doubt};
}

}  // namespace crepes
