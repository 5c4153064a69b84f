#include "net/subscription/subscriber_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

namespace crepes {
namespace {

constexpr Duration kErrorInterval = std::chrono::seconds{1};
constexpr std::size_t kMaxErring = 256;  // clients that are stored at a time, here and elsewhere

bool wants(const WatchRequest& request, RobotId neighbor) {
  return !request.peers || std::count(request.peers->begin(), request.peers->end(), neighbor) > 0;
}

}  // namespace

Result<void> SubscriberTable::watch(const Endpoint& client, const WatchRequest& request,
                                    Timestamp now, std::size_t socket, bool is_light_user) {
  expire(now);
  if (!request.enable) {
    subscribers_.erase(client);
    return {};
  }
  if (!subscribers_.contains(client)) {
    if (Result<void> room = make_room(client, now, is_light_user); !room) return room;
  }
  Subscriber& subscriber = subscribers_[client];
  if (subscriber.rate.rate_hz() != request.rate_hz) subscriber.rate = RateDivider(request.rate_hz);
  subscriber.request = request;
  subscriber.socket = socket;
  subscriber.lease_end = now + from_seconds(config_.lease_s);
  return {};
}

/// Remote clients leave room for programs of this machine, whatever the size of the table.
Result<void> SubscriberTable::find_place(const Endpoint& client) const {
  const int limit = config_.max_subscribers;
  if (subscribers_.size() >= static_cast<std::size_t>(limit))
    return fail(ErrorCode::kUsage, fmt::format("too many subscribers, at most {}", limit));
  if (client.is_loopback()) return {};
  const int remote_limit = limit - std::min(config_.max_per_address, limit / 2);
  const auto is_remote = [](const auto& entry) { return !entry.first.is_loopback(); };
  if (std::ranges::count_if(subscribers_, is_remote) < remote_limit) return {};
  return fail(ErrorCode::kUsage,
              fmt::format("too many subscribers on other machines, at most {}", remote_limit));
}

Result<void> SubscriberTable::make_room(const Endpoint& client, Timestamp now, bool is_light_user) {
  if (Result<void> place = find_place(client); !place) return place;
  const auto is_beside = [&](const auto& entry) {
    return entry.first.address == client.address ||
           (entry.first.is_loopback() && client.is_loopback());
  };
  if (std::ranges::count_if(subscribers_, is_beside) < config_.max_per_address) return {};
  const auto floods = std::ranges::find_if(subscribers_, [&](const auto& entry) {
    return is_light_user && is_beside(entry) &&
           entry.second.last_excess >= now - from_seconds(config_.lease_s);
  });
  if (floods == subscribers_.end()) {
    return fail(ErrorCode::kUsage, fmt::format("too many subscribers at this address, at most {} "
                                               "(subscription.max_per_address)",
                                               config_.max_per_address));
  }
  subscribers_.erase(floods);
  return {};
}

std::optional<bool> SubscriberTable::allows(const Endpoint& client, Timestamp now) {
  const auto subscriber = subscribers_.find(client);
  if (subscriber == subscribers_.end()) return std::nullopt;
  const bool is_admitted = subscriber->second.requests.try_consume(now);
  if (!is_admitted) subscriber->second.last_excess = now;
  return is_admitted;
}

std::vector<PoseDelivery> SubscriberTable::deliveries(RobotId neighbor, Timestamp stamp) {
  std::vector<PoseDelivery> due;
  for (auto& [client, subscriber] : subscribers_) {
    if (!wants(subscriber.request, neighbor) || !subscriber.rate.is_due(neighbor, stamp)) continue;
    due.push_back({client, subscriber.sequence++, subscriber.socket});
  }
  return due;
}

void SubscriberTable::expire(Timestamp now) {
  std::erase_if(subscribers_, [&](const auto& entry) { return entry.second.lease_end < now; });
}

bool SubscriberTable::allows_error(const Endpoint& client, Timestamp now) {
  auto& last_errors = client.is_loopback() ? last_local_errors_ : last_remote_errors_;
  std::erase_if(last_errors,
                [&](const auto& entry) { return now - entry.second >= kErrorInterval; });
  if (last_errors.size() >= kMaxErring) return false;
  return last_errors.try_emplace(client, now).second;
}

}  // namespace crepes
