#include "net/subscription/rate_divider.hpp"

#include <algorithm>

namespace crepes {
namespace {

constexpr double kSlack = 0.1;  // of a period: tolerates jitter of the stamps

}  // namespace

bool RateDivider::is_due(RobotId neighbor, Timestamp stamp) {
  if (!rate_hz_) return true;
  Timestamp& next = next_.try_emplace(neighbor, stamp).first->second;
  if (stamp < next - from_seconds(kSlack / *rate_hz_)) return false;
  next = std::max(next + from_seconds(1 / *rate_hz_), stamp);  // no burst after a pause
  return true;
}

}  // namespace crepes
