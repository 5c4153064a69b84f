#include "net/subscriber_table.hpp"

#include <algorithm>
#include <chrono>

namespace crepes {
namespace {

constexpr Duration kErrorInterval = std::chrono::seconds{1};
constexpr std::size_t kMaxErring = 256;  // clients that are remembered at a time
constexpr double kSlack = 0.1;           // of a period: stamps of even poses are not quite even

bool wants(const WatchRequest& wish, RobotId neighbor) {
  return !wish.peers || std::count(wish.peers->begin(), wish.peers->end(), neighbor) > 0;
}

}  // namespace

Result<void> SubscriberTable::watch(const Endpoint& client, const WatchRequest& request,
                                    Timestamp now) {
  expire(now);
  if (!request.enable) {
    subscribers_.erase(client);
    return {};
  }
  const auto limit = static_cast<std::size_t>(config_.max_subscribers);
  if (!subscribers_.contains(client) && subscribers_.size() >= limit)
    return fail(ErrorCode::kUsage, "too many subscribers, at most " + std::to_string(limit));

  Subscriber& subscriber = subscribers_[client];
  if (subscriber.wish.rate_hz != request.rate_hz) subscriber.next_due.clear();
  subscriber.wish = request;
  subscriber.lease_end = now + from_seconds(config_.lease_s);
  return {};
}

std::vector<PoseDelivery> SubscriberTable::deliveries(RobotId neighbor, Timestamp stamp) {
  std::vector<PoseDelivery> due;
  for (auto& [client, subscriber] : subscribers_) {
    if (!wants(subscriber.wish, neighbor)) continue;
    if (subscriber.wish.rate_hz) {
      const Duration period = from_seconds(1 / *subscriber.wish.rate_hz);
      const auto slack = from_seconds(kSlack / *subscriber.wish.rate_hz);
      Timestamp& next = subscriber.next_due.try_emplace(neighbor, stamp).first->second;
      if (stamp < next - slack) continue;
      next = std::max(next + period, stamp);  // after a pause, no burst to catch up
    }
    due.push_back({client, subscriber.sequence++});
  }
  return due;
}

void SubscriberTable::expire(Timestamp now) {
  std::erase_if(subscribers_, [&](const auto& entry) { return entry.second.lease_end < now; });
}

bool SubscriberTable::admits_error(const Endpoint& client, Timestamp now) {
  std::erase_if(last_errors_,
                [&](const auto& entry) { return now - entry.second >= kErrorInterval; });
  if (last_errors_.size() >= kMaxErring) return false;
  return last_errors_.try_emplace(client, now).second;
}

}  // namespace crepes
