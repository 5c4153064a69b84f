#include "daemon/stages/subscription_server.hpp"

#include <sodium.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/service/logging.hpp"
#include "daemon/version.hpp"
#include "net/subscription/subscription_json.hpp"

namespace crepes {
namespace {

constexpr int kMaxRequestsAtOnce = 64;  ///< per socket, so that a flood does not delay poses

std::string_view text_of(const Datagram& datagram) {
  const auto* const begin = static_cast<const void*>(datagram.bytes.data());
  return {static_cast<const char*>(begin), datagram.bytes.size()};
}

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

HashKey random_key() {
  HashKey key{};
  randombytes_buf(key.data(), key.size());
  return key;
}

void append(std::string& faults, const std::string& fault) {
  if (!faults.empty() && !fault.empty()) faults += "; ";
  faults += fault;
}

/// Where there is no IPv6, nobody can ask at ::1, which is served by default.
bool is_without_clients(const std::string& address) {
  return address == "::1" && !UdpSocket::bind(address, 0);
}

}  // namespace

SubscriptionServer::SubscriptionServer(RobotId self, const std::map<RobotId, std::string>& names,
                                       const SubscriptionConfig& config,
                                       SubscriptionService::StatusSource status)
    : self_(self),
      service_(config, std::string(kVersion), std::move(status), random_key()),
      port_(static_cast<std::uint16_t>(config.port)),
      unserved_(config.listen) {
  reconfigure(names, config);
}

void SubscriptionServer::reconfigure(const std::map<RobotId, std::string>& names,
                                     const SubscriptionConfig& config) {
  service_.reconfigure(config);
  if (config.push != push_configs_ || names != names_) {
    pushes_.clear();
    push_faults_.clear();
    for (const PushConfig& push : config.push) pushes_.emplace_back(push, self_, names);
  }
  push_configs_ = config.push;
  names_ = names;
  open_missing();
}

void SubscriptionServer::open_missing() {
  std::string fault = open_listen();
  append(fault, open_push());
  for (const auto& [target, error] : push_faults_) append(fault, "push: " + error);
  if (fault == fault_) return;
  if (fault.empty()) {
    log_message(LogLevel::kInfo, "subscription: works again");
  } else {
    log_message(LogLevel::kWarning, "subscription: " + fault);
  }
  fault_ = std::move(fault);
}

/// Subscribers refer to sockets by their index, so new ones are appended.
std::string SubscriptionServer::open_listen() {
  std::string faults;
  std::erase_if(unserved_, [&](const std::string& address) {
    Result<UdpSocket> opened = UdpSocket::bind(address, port_);
    if (!opened) {
      if (!is_without_clients(address)) append(faults, opened.error().message);
      return false;
    }
    sockets_.push_back(std::move(*opened));
    return true;
  });
  return faults;
}

std::string SubscriptionServer::open_push() {
  std::string faults;
  const auto open = [&](bool ipv4, std::optional<UdpSocket>& socket) {
    const bool is_needed = std::ranges::any_of(
        pushes_, [&](const PosePush& push) { return push.target().is_ipv4() == ipv4; });
    if (!is_needed || socket) return;
    Result<UdpSocket> opened = UdpSocket::bind(ipv4 ? "0.0.0.0" : "::", 0);
    if (opened) {
      socket = std::move(*opened);
    } else {
      append(faults, "push: " + opened.error().message);
    }
  };
  open(true, push_ipv4_);
  open(false, push_ipv6_);
  return faults;
}

void SubscriptionServer::serve(Timestamp now) {
  for (std::size_t socket = 0; socket < sockets_.size(); ++socket) {
    for (int i = 0; i < kMaxRequestsAtOnce; ++i) {
      const Result<std::optional<Datagram>> request =
          sockets_[socket].receive(std::chrono::milliseconds{0});
      // An error here means that a client has gone (ICMP). The next datagram is from another
      // client.
      if (!request || !*request) break;
      const Datagram& datagram = **request;
      const std::size_t way = index_of({socket, datagram.to});
      if (const auto answer = service_.answer(datagram.from, text_of(datagram), now, way))
        send(way, *answer, datagram.from);
    }
  }
}

void SubscriptionServer::publish(const std::vector<NeighborPose>& poses, Timestamp now) {
  for (const NeighborPose& pose : poses) {
    for (const PoseDelivery& delivery : service_.deliveries(pose.neighbor, pose.stamp, now)) {
      const std::string json = pose_json(delivery.sequence, self_, names_[pose.neighbor], pose);
      if (send(delivery.socket, json, delivery.client)) ++poses_;
    }
  }
  for (PosePush& push : pushes_) {
    auto& socket = push.target().is_ipv4() ? push_ipv4_ : push_ipv6_;
    if (!socket) continue;
    for (const std::string& json : push.datagrams(poses))
      note_push(push.target(), socket->send_to(bytes_of(json), push.target()));
  }
}

/// A system that is busy is no fault of the target's.
void SubscriptionServer::note_push(const Endpoint& target, const Result<void>& sent) {
  if (sent) {
    ++pushed_;
    push_faults_.erase(target);
    return;
  }
  ++unsent_;
  if (sent.error().code != ErrorCode::kBusy) push_faults_[target] = sent.error().message;
}

std::vector<int> SubscriptionServer::descriptors() const {
  std::vector<int> found;
  for (const UdpSocket& socket : sockets_) found.push_back(socket.descriptor());
  return found;
}

std::vector<std::pair<std::string, std::uint64_t>> SubscriptionServer::counters() const {
  auto totals = service_.counters();
  totals.insert(
      totals.end(),
      {{"poses_sent", poses_}, {"datagrams_pushed", pushed_}, {"answers_unsent", unsent_}});
  return totals;
}

/// A machine has few addresses, but all of 127.0.0.0/8 are its own: the answer to one beyond comes
/// from whichever the system chooses.
std::size_t SubscriptionServer::index_of(const Way& way) {
  constexpr std::size_t kMost = 64;
  const auto found = std::ranges::find(ways_, way);
  if (found == ways_.end() && way.own && ways_.size() >= kMost) return index_of({way.socket});
  if (found == ways_.end()) return ways_.push_back(way), ways_.size() - 1;
  return static_cast<std::size_t>(found - ways_.begin());
}

/// A client hears only the address that it asked.
bool SubscriptionServer::send(std::size_t way, const std::string& json, const Endpoint& to) {
  const auto& [socket, own] = ways_.at(way);
  const bool is_sent = sockets_[socket].send_to(bytes_of(json), to, own).has_value();
  if (!is_sent) ++unsent_;
  return is_sent;
}

}  // namespace crepes
