#include "daemon/ctl/score/gross_errors.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr Duration kRowPeriod = std::chrono::milliseconds(20);
constexpr Duration kLongestRowGap = std::chrono::milliseconds(500);

void add_pose(GrossErrors& errors, double position_m, bool beyond) {
  ++errors.poses;
  if (beyond) ++errors.beyond;
  errors.max_position_m = std::max(errors.max_position_m, position_m);
}

void merge(GrossErrors& errors, const GrossErrors& more) {
  errors.poses += more.poses;
  errors.beyond += more.beyond;
  errors.longest_run = std::max(errors.longest_run, more.longest_run);
  errors.max_position_m = std::max(errors.max_position_m, more.max_position_m);
}

}  // namespace

double GrossErrors::share() const {
  return static_cast<double>(beyond) / static_cast<double>(poses);
}

void merge(GrossErrorsByMode& errors, const GrossErrorsByMode& more) {
  merge(errors.all, more.all);
  for (std::size_t i = 0; i < errors.modes.size(); ++i) merge(errors.modes[i], more.modes[i]);
}

void GrossErrorCounter::add(Timestamp stamp, PoseMode mode, double position_m,
                            double mahalanobis2) {
  const bool beyond = !(mahalanobis2 <= kGrossMahalanobis2);
  GrossErrors& of_mode = errors_.modes.at(static_cast<std::size_t>(mode));
  add_pose(errors_.all, position_m, beyond);
  add_pose(of_mode, position_m, beyond);

  const bool after_gap = stamp - last_ > kLongestRowGap;
  if (!beyond || after_gap) begin_.reset();
  if (!beyond || after_gap || mode != mode_) mode_begin_.reset();
  last_ = stamp;
  mode_ = mode;
  if (!beyond) return;
  if (!begin_) begin_ = stamp;
  if (!mode_begin_) mode_begin_ = stamp;
  errors_.all.longest_run = std::max(errors_.all.longest_run, stamp - *begin_ + kRowPeriod);
  of_mode.longest_run = std::max(of_mode.longest_run, stamp - *mode_begin_ + kRowPeriod);
}

}  // namespace crepes
