#include "net/subscriber_table.hpp"

#include <algorithm>
#include <chrono>

namespace crepes {
namespace {

constexpr Duration kErrorInterval = std::chrono::seconds{1};
constexpr std::size_t kMaxErring = 256;  // clients that are remembered at a time

bool wants(const WatchRequest& wish, RobotId neighbor) {
  return !wish.peers || std::count(wish.peers->begin(), wish.peers->end(), neighbor) > 0;
}

}  // namespace

Result<void> SubscriberTable::watch(const Endpoint& client, const WatchRequest& request,
                                    Timestamp now, std::size_t via, bool asks_little) {
  expire(now);
  if (!request.enable) {
    subscribers_.erase(client);
    return {};
  }
  if (!subscribers_.contains(client)) {
    if (Result<void> room = make_room(client, now, asks_little); !room) return room;
  }
  Subscriber& subscriber = subscribers_[client];
  if (subscriber.rate.rate_hz() != request.rate_hz) subscriber.rate = PoseRate(request.rate_hz);
  subscriber.wish = request;
  subscriber.via = via;
  subscriber.lease_end = now + from_seconds(config_.lease_s);
  return {};
}

Result<void> SubscriberTable::make_room(const Endpoint& client, Timestamp now, bool asks_little) {
  const auto limit = static_cast<std::size_t>(config_.max_subscribers);
  if (subscribers_.size() >= limit)
    return fail(ErrorCode::kUsage, "too many subscribers, at most " + std::to_string(limit));
  const auto is_beside = [&](const auto& entry) { return entry.first.address == client.address; };
  if (std::ranges::count_if(subscribers_, is_beside) < config_.max_per_address) return {};
  const auto floods = std::ranges::find_if(subscribers_, [&](const auto& entry) {
    return asks_little && is_beside(entry) &&
           entry.second.last_excess >= now - from_seconds(config_.lease_s);
  });
  if (floods == subscribers_.end()) {
    return fail(ErrorCode::kUsage, "too many subscribers at this address, at most " +
                                       std::to_string(config_.max_per_address));
  }
  subscribers_.erase(floods);
  return {};
}

std::optional<bool> SubscriberTable::admits(const Endpoint& client, Timestamp now) {
  const auto subscriber = subscribers_.find(client);
  if (subscriber == subscribers_.end()) return std::nullopt;
  const bool is_admitted = subscriber->second.requests.take(now);
  if (!is_admitted) subscriber->second.last_excess = now;
  return is_admitted;
}

std::vector<PoseDelivery> SubscriberTable::deliveries(RobotId neighbor, Timestamp stamp) {
  std::vector<PoseDelivery> due;
  for (auto& [client, subscriber] : subscribers_) {
    if (!wants(subscriber.wish, neighbor) || !subscriber.rate.is_due(neighbor, stamp)) continue;
    due.push_back({client, subscriber.sequence++, subscriber.via});
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
