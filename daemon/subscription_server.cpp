#include "daemon/subscription_server.hpp"

#include <chrono>
#include <utility>

#include "daemon/version.hpp"
#include "net/subscription_json.hpp"

namespace crepes {
namespace {

constexpr int kMaxRequestsAtOnce = 64;  ///< a socket, so that a flood does not delay poses

std::string_view text_of(const Datagram& datagram) {
  const auto* const begin = static_cast<const void*>(datagram.bytes.data());
  return {static_cast<const char*>(begin), datagram.bytes.size()};
}

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

}  // namespace

SubscriptionServer::SubscriptionServer(const Config& config, StatusSource status)
    : self_(config.robot.id),
      lease_s_(config.subscription.lease_s),
      status_(std::move(status)),
      table_(config.subscription) {
  for (const MemberConfig& member : config.swarm.members) names_[member.id] = member.name;
  for (const std::string& address : config.subscription.listen) {
    Result<UdpSocket> socket =
        UdpSocket::bind(address, static_cast<std::uint16_t>(config.subscription.port));
    if (socket) {
      sockets_.push_back(std::move(*socket));
    } else {
      faults_.push_back("subscription: " + socket.error().message);
    }
  }
}

void SubscriptionServer::serve(Timestamp now) {
  table_.expire(now);
  for (UdpSocket& socket : sockets_) {
    for (int i = 0; i < kMaxRequestsAtOnce; ++i) {
      const Result<std::optional<Datagram>> request = socket.receive(std::chrono::milliseconds{0});
      // An error here is a client that went away (ICMP): the next datagram is another's.
      if (!request || !*request) break;
      answer(socket, **request, now);
    }
  }
}

void SubscriptionServer::publish(const NeighborPose& pose, Timestamp now) {
  table_.expire(now);
  const auto name = names_.find(pose.neighbor);
  if (name == names_.end()) return;
  for (const PoseDelivery& delivery : table_.deliveries(pose.neighbor, pose.stamp)) {
    UdpSocket* socket = socket_for(delivery.client);
    if (socket == nullptr) continue;
    send(*socket, pose_json(delivery.sequence, self_, name->second, pose), delivery.client);
    ++poses_;
  }
}

std::vector<int> SubscriptionServer::descriptors() const {
  std::vector<int> found;
  for (const UdpSocket& socket : sockets_) found.push_back(socket.descriptor());
  return found;
}

std::vector<std::pair<std::string, std::uint64_t>> SubscriptionServer::counters() const {
  return {{"subscribers", table_.size()},
          {"requests", requests_},
          {"requests_refused", refused_},
          {"poses_sent", poses_},
          {"answers_unsent", unsent_}};
}

void SubscriptionServer::answer(UdpSocket& socket, const Datagram& request, Timestamp now) {
  if (!SubscriberTable::is_served(request.from)) return;
  ++requests_;
  const auto refuse = [&](const Error& error) {
    ++refused_;
    if (table_.admits_error(request.from, now))
      send(socket, error_json(error.message), request.from);
  };
  const Result<SubscriptionRequest> parsed = parse_request(text_of(request));
  if (!parsed) return refuse(parsed.error());
  if (std::holds_alternative<PollRequest>(*parsed))
    return send(socket, status_json(status_()), request.from);
  const Result<void> watched = table_.watch(request.from, std::get<WatchRequest>(*parsed), now);
  if (!watched) return refuse(watched.error());
  send(socket, version_json(kVersion, lease_s_), request.from);
}

void SubscriptionServer::send(UdpSocket& socket, const std::string& json, const Endpoint& to) {
  if (!socket.send_to(bytes_of(json), to)) ++unsent_;
}

UdpSocket* SubscriptionServer::socket_for(const Endpoint& client) {
  for (UdpSocket& socket : sockets_) {
    if (socket.local().is_ipv4() == client.is_ipv4()) return &socket;
  }
  return nullptr;
}

}  // namespace crepes
