#include "net/subscription/subscription_service.hpp"

namespace crepes {

SubscriptionService::SubscriptionService(const SubscriptionConfig& config, std::string release,
                                         StatusSource status, const HashKey& key)
    : port_(config.port),
      lease_s_(config.lease_s),
      release_(std::move(release)),
      status_(std::move(status)),
      table_(config),
      cookies_(key),
      limiter_(key) {}

void SubscriptionService::reconfigure(const SubscriptionConfig& config) {
  port_ = config.port;
  lease_s_ = config.lease_s;
  table_.reconfigure(config);
}

std::optional<std::string> SubscriptionService::answer(const Endpoint& client,
                                                       std::string_view request, Timestamp now,
                                                       std::size_t socket) {
  // Our own port, here or on another robot: two daemons must not answer each other forever.
  if (!client.is_unicast() || client.port == port_) {
    ++unanswerable_;
    return std::nullopt;
  }
  if (!allows(client, request, now)) {
    ++excess_;
    return std::nullopt;
  }
  ++requests_;
  const Result<SubscriptionRequest> parsed = parse_request(request);
  if (client.is_loopback() || (parsed && cookies_.accepts(parsed->cookie, client, now)))
    return parsed ? serve(client, *parsed, now, socket) : refuse(client, parsed.error(), now);

  ++unverified_;
  std::optional<std::string> answer =
      parsed ? cookie_json(cookies_.cookie_for(client, now)) : refuse(client, parsed.error(), now);
  return answer && answer->size() <= request.size() ? std::move(answer) : std::nullopt;
}

// A client that forges a subscriber's address has no valid cookie, so it consumes the tokens of
// clients without a subscription.
bool SubscriptionService::allows(const Endpoint& client, std::string_view request, Timestamp now) {
  table_.expire(now);
  const bool is_proven = client.is_loopback() || (request.size() <= kMaxSubscriptionDatagram &&
                                                  cookies_.is_contained_in(request, client, now));
  const std::optional<bool> subscriber =
      is_proven ? table_.allows(client, now) : std::optional<bool>{};
  return subscriber ? *subscriber : limiter_.allows(client, now);
}

std::optional<std::string> SubscriptionService::serve(const Endpoint& client,
                                                      const SubscriptionRequest& request,
                                                      Timestamp now, std::size_t socket) {
  if (const auto* poll = std::get_if<PollRequest>(&request.what)) {
    if (auto status = status_of(*poll)) return status;
    const char* const reason = poll->sensor ? "\"sensor\" is no sensor of this robot"
                                            : "\"peer\" is no other robot of this swarm";
    return refuse(client, {ErrorCode::kNotFound, reason}, now);
  }
  const auto watched = table_.watch(client, std::get<WatchRequest>(request.what), now, socket,
                                    limiter_.is_light_user(client));
  if (!watched) return refuse(client, watched.error(), now);
  return version_json(release_, lease_s_);
}

/// Empty if there is no such peer or sensor.
std::optional<std::string> SubscriptionService::status_of(const PollRequest& poll) const {
  const SystemStatus status = status_();
  if (poll.sensor) return sensor_status_json(status, *poll.sensor);
  if (!poll.peer) {
    return poll.about == StatusPart::kTeam ? team_status_json(status)
                                           : status_json(status, poll.about);
  }
  switch (poll.about) {
    case StatusPart::kTeam:
      return team_status_json(status, *poll.peer);
    case StatusPart::kPair:
      return pair_status_json(status, *poll.peer);
    default:
      return peer_status_json(status, *poll.peer);
  }
}

std::optional<std::string> SubscriptionService::refuse(const Endpoint& client, const Error& error,
                                                       Timestamp now) {
  ++refused_;
  if (!table_.allows_error(client, now)) return std::nullopt;
  return error_json(error.message);
}

std::vector<PoseDelivery> SubscriptionService::deliveries(RobotId neighbor, Timestamp stamp,
                                                          Timestamp now) {
  table_.expire(now);
  return table_.deliveries(neighbor, stamp);
}

std::vector<std::pair<std::string, std::uint64_t>> SubscriptionService::counters() const {
  return {{"subscribers", table_.size()},       {"requests", requests_},
          {"requests_refused", refused_},       {"requests_in_excess", excess_},
          {"requests_unverified", unverified_}, {"requests_unanswerable", unanswerable_}};
}

}  // namespace crepes
