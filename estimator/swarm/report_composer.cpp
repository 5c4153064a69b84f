#include "estimator/swarm/report_composer.hpp"

namespace crepes {
namespace {

constexpr Duration kRepeated = std::chrono::milliseconds{520};

}  // namespace

std::optional<Report> ReportComposer::compose(Timestamp now, const RobotState& self,
                                              const std::vector<NeighborEstimate>& estimates) {
  // Of each neighbor the newest frame's bearings: two of them where a mirror image shows it twice.
  for (auto& [neighbor, seen] : newest_) {
    for (const Bearing& bearing : seen) {
      if (bearing.stamp == seen.back().stamp) bearings_.add(bearing);
    }
    seen.clear();
  }
  bearings_.drop_before(now - kRepeated);
  ranges_.drop_before(now - kRepeated);
  if (!self.tilt) return std::nullopt;

  Report report;
  report.sender = self_;
  report.stamp = now;
  report.tilt = *self.tilt;
  std::size_t first = self.imu.size();
  while (first > 0 && self.imu[first - 1].stamp >= now - kRepeated) --first;
  report.imu.reserve(self.imu.size() - first);
  for (std::size_t i = first; i < self.imu.size(); ++i) report.imu.push_back(self.imu[i]);
  report.bearings = bearings_.all();
  report.ranges = ranges_.all();
  report.estimates = estimates;
  return report;
}

}  // namespace crepes
