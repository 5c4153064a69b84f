#include "estimator/vision/gyro_history.hpp"

#include <algorithm>

namespace crepes {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMaxSamples = 64;
constexpr Duration kStep = 5ms;
constexpr std::int64_t kMaxSteps = 100;

}  // namespace

bool GyroHistory::add(const ImuSample& sample) {
  if (!sample.gyro_radps.allFinite()) return false;
  if (!samples_.empty() && sample.stamp <= samples_.back().stamp) return false;
  samples_.push_back({sample.stamp, sample.gyro_radps});
  if (samples_.size() > kMaxSamples) samples_.erase(samples_.begin());
  return true;
}

Eigen::Vector3d GyroHistory::rate_at(Timestamp stamp) const {
  const auto after =
      std::lower_bound(samples_.begin(), samples_.end(), stamp,
                       [](const Sample& sample, Timestamp t) { return sample.stamp < t; });
  if (after == samples_.end()) return samples_.back().gyro_radps;
  if (after == samples_.begin()) return after->gyro_radps;
  const Sample& before = *std::prev(after);
  const double part = to_seconds(stamp - before.stamp) / to_seconds(after->stamp - before.stamp);
  return before.gyro_radps + part * (after->gyro_radps - before.gyro_radps);
}

Eigen::Quaterniond GyroHistory::rotation(Timestamp from, Timestamp to) const {
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
  if (samples_.empty() || to <= from) return R;
  const std::int64_t steps = std::clamp<std::int64_t>((to - from) / kStep, 1, kMaxSteps);
  const Duration step = (to - from) / steps;
  for (std::int64_t i = 0; i < steps; ++i)
    R = R * so3_exp(rate_at(from + step * i + step / 2) * to_seconds(step));
  return R.normalized();
}

}  // namespace crepes
