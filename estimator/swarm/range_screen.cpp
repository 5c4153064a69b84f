#include "estimator/swarm/range_screen.hpp"

#include <algorithm>
#include <cmath>

namespace crepes {
namespace {

// Of the share of late ranges: the weight of one range, and the time after which few ranges count.
constexpr double kLateMemory = 1.0 / 16.0;
constexpr double kLateMemoryTime = 0.3;  // s
constexpr double kHiddenShare = 0.25;    // fewer ranges are late in line of sight

}  // namespace

bool RangeScreen::accepts(const UwbRange& range, const FilterSettings& settings) {
  const bool is_plausible = range.range_m > 0.0 && range.range_m <= settings.max_range_m;
  const bool is_late = range.received_dbm - range.first_path_dbm > settings.late_path_db;
  const double passed_s =
      latest_ ? std::max(0.0, to_seconds(range.stamp - *latest_)) : kLateMemoryTime * 1e3;
  const double weight = std::max(kLateMemory, 1.0 - std::exp(-passed_s / kLateMemoryTime));
  late_share_ += weight * ((is_late ? 1.0 : 0.0) - late_share_);
  latest_ = latest_ ? std::max(*latest_, range.stamp) : range.stamp;
  return is_plausible && !is_late && late_share_ <= kHiddenShare;
}

}  // namespace crepes
