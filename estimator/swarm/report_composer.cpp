#include "estimator/swarm/report_composer.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr Duration kRepeated = std::chrono::milliseconds{520};

/// In order of their stamps. Spikes are among them, as they were measured: peers refuse them too,
/// and so know of a blow that may be real.
std::vector<ImuSample> samples_since(Timestamp since, const RobotState& self) {
  std::vector<ImuSample> samples;
  std::size_t first = self.imu.size();
  while (first > 0 && self.imu[first - 1].stamp >= since) --first;
  samples.reserve(self.imu.size() - first + self.guard.spikes().size());
  for (std::size_t i = first; i < self.imu.size(); ++i) samples.push_back(self.imu[i]);
  for (const ImuSample& spike : self.guard.spikes()) {
    if (spike.stamp < since) continue;
    const auto place = std::ranges::lower_bound(samples, spike.stamp, {}, &ImuSample::stamp);
    if (place != samples.end() && place->stamp == spike.stamp) {
      *place = spike;  // of which the rate is kept
    } else {
      samples.insert(place, spike);
    }
  }
  return samples;
}

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
  report.imu = samples_since(now - kRepeated, self);
  report.bearings = bearings_.all();
  report.ranges = ranges_.all();
  report.estimates = estimates;
  return report;
}

}  // namespace crepes
