#include "estimator/swarm/report_composer.hpp"

namespace crepes {
namespace {

constexpr Duration kRepeated = std::chrono::milliseconds{160};

template <class Readings>
void forget_before(Timestamp t, Readings& readings) {
  while (!readings.empty() && readings.front().stamp < t) readings.pop_front();
}

}  // namespace

std::optional<Report> ReportComposer::compose(Timestamp now, const RobotState& self,
                                              const std::vector<NeighborEstimate>& estimates) {
  // Of each neighbor the newest frame's bearings: two of them where a mirror image shows it twice.
  for (auto& [neighbor, seen] : newest_) {
    for (const Bearing& bearing : seen) {
      if (bearing.stamp == seen.back().stamp) bearings_.push_back(bearing);
    }
    seen.clear();
  }
  forget_before(now - kRepeated, bearings_);
  forget_before(now - kRepeated, ranges_);
  if (!self.tilt) return std::nullopt;

  Report report;
  report.sender = self_;
  report.stamp = now;
  report.tilt = *self.tilt;
  for (std::size_t i = 0; i < self.imu.size(); ++i) {
    if (self.imu[i].stamp >= now - kRepeated) report.imu.push_back(self.imu[i]);
  }
  report.bearings.assign(bearings_.begin(), bearings_.end());
  report.ranges.assign(ranges_.begin(), ranges_.end());
  report.estimates = estimates;
  return report;
}

}  // namespace crepes
