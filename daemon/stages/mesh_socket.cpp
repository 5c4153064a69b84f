#include "daemon/stages/mesh_socket.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "config/keys/mesh_key.hpp"
#include "daemon/service/logging.hpp"

namespace crepes {

UdpSocket* MeshSocket::get(Timestamp now) {
  if (socket_ || now < retry_at_) return socket_ ? &*socket_ : nullptr;
  Result<UdpSocket> opened = open();
  if (!opened) {
    close_for_retry(opened.error(), now);
    return nullptr;
  }
  if (!fault_.empty()) log_message(LogLevel::kInfo, "mesh: works again");
  fault_.clear();
  retry_ = kFirstRetry;
  socket_ = std::move(*opened);
  return &*socket_;
}

Result<UdpSocket> MeshSocket::open() {
  const auto open_socket = [this] {
    return UdpSocket::open_broadcast(config_.interface, static_cast<std::uint16_t>(config_.port));
  };
  if (config_.key_file.empty()) return open_socket();
  const Result<MeshKey> key = read_mesh_key(config_.key_file);
  if (!key) return tl::unexpected(key.error());
  seal_.emplace(*key);
  return open_socket().map([&](UdpSocket&& socket) {
    log_message(LogLevel::kInfo, "mesh: sealed with the key " + fingerprint(*key));
    return std::move(socket);
  });
}

void MeshSocket::close_for_retry(const Error& error, Timestamp now) {
  constexpr Duration kLastRetry = std::chrono::seconds{5};
  socket_.reset();
  if (error.message != fault_) log_message(LogLevel::kWarning, "mesh: " + error.message);
  fault_ = error.message;
  retry_at_ = now + retry_;
  retry_ = std::min(2 * retry_, kLastRetry);
}

void KeyMismatchMonitor::update(const PeerLink& link) {
  constexpr const char* kOtherKey =
      "no datagram that comes can be opened: net.key_file is not the same on all robots";
  const std::uint64_t total_received = link.counters()[MeshCounter::kReceived];
  const std::uint64_t total_unopened = link.counters().seal_refusals();
  const std::uint64_t received = total_received - std::exchange(received_, total_received);
  const std::uint64_t unopened = total_unopened - std::exchange(unopened_, total_unopened);
  const std::string before =
      std::exchange(fault_, received > 0 && unopened == received ? kOtherKey : "");
  if (!fault_.empty() && before.empty()) log_message(LogLevel::kWarning, "mesh: " + fault_);
}

void DoubledIdMonitor::update(const PeerLink& link, const Endpoint& from, Timestamp arrival) {
  const std::optional<DoubledId>& doubled = link.doubled_id();
  if (!doubled || doubled->last != arrival) return;
  const bool is_new = fault(arrival).empty();
  last_ = arrival;
  fault_ =
      fmt::format("a second robot uses id {}: it sends from {}; give each robot its own robot.id",
                  doubled->robot.value, from.to_string());
  if (is_new) log_message(LogLevel::kError, "mesh: " + fault_);
}

std::string DoubledIdMonitor::fault(Timestamp now) const {
  constexpr Duration kMemory = std::chrono::seconds{5};
  return last_ && now - *last_ < kMemory ? fault_ : "";
}

}  // namespace crepes
