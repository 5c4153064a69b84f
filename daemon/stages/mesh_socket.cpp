#include "daemon/stages/mesh_socket.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <utility>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "daemon/service/logging.hpp"

namespace crepes {

UdpSocket* MeshSocket::get(Timestamp now) {
  if (socket_ || now < retry_at_) return socket_ ? &*socket_ : nullptr;
  Result<UdpSocket> opened = open();
  if (!opened) {
    close_for_retry(opened.error(), now);
    return nullptr;
  }
  // Only use shows that a socket can be used again; see also follow_address.
  if (!failed_in_use_) end_fault();
  socket_ = std::move(*opened);
  opened_ = now;
  return &*socket_;
}

void MeshSocket::follow_address(Timestamp now) {
  if (!socket_) return;
  const Result<Endpoint> address = UdpSocket::broadcast_address(config_.interface, port());
  if (!address) return close_for_retry(address.error(), now);
  if (*address == socket_->local()) {
    constexpr Duration kTrialTime = std::chrono::seconds{1};
    if (now - opened_ >= kTrialTime) end_fault();  // a robot without a tilt sends nothing
    return;
  }
  log_message(LogLevel::kWarning, fmt::format("mesh: {}: another address; datagrams go to {} now",
                                              config_.interface, address->to_string()));
  socket_.reset();
}

void MeshSocket::end_fault() {
  if (fault_.empty()) return;
  log_message(LogLevel::kInfo, "mesh: works again");
  fault_.clear();
  retry_ = kFirstRetry;
}

Result<UdpSocket> MeshSocket::open() {
  const Result<std::string> keys = read_keys();
  if (!keys) return tl::unexpected(keys.error());
  auto socket = UdpSocket::open_broadcast(config_.interface, port());
  if (!socket || *keys == logged_keys_) return socket;
  log_message(LogLevel::kInfo, "mesh: " + *keys);
  if (keys_may_be_swapped())
    log_message(LogLevel::kWarning, fmt::format("mesh: {}", kKeysUnlocked));
  logged_keys_ = *keys;
  return socket;
}

Result<std::string> MeshSocket::read_keys() {
  std::string text;
  if (!config_.key_file.empty()) {
    const Result<MeshKey> key = read_mesh_key(config_.key_file);
    if (!key) return tl::unexpected(key.error());
    seal_.emplace(*key);
    text = "sealed with the key " + fingerprint(*key);
  }
  if (!config_.robot_key_file.empty()) {
    const Result<RobotKey> key = read_robot_key(config_.robot_key_file);
    if (!key) return tl::unexpected(key.error());
    signer_.emplace(*key);
    text += fmt::format("{}signed with the key {}", text.empty() ? "" : ", ",
                        to_text(public_key_of(*key)));
  }
  return text;
}

void MeshSocket::close_for_retry(const Error& error, Timestamp now) {
  constexpr Duration kLastRetry = std::chrono::seconds{5};
  failed_in_use_ = socket_.has_value();
  socket_.reset();
  if (error.message != fault_) log_message(LogLevel::kWarning, "mesh: " + error.message);
  fault_ = error.message;
  retry_at_ = now + retry_;
  retry_ = std::min(2 * retry_, kLastRetry);
}

void KeyMismatchMonitor::update(const PeerLink& link) {
  constexpr const char* kOtherKey =
      "no datagram that comes can be opened: net.key_file is not the same on all robots";
  constexpr const char* kOtherSigner =
      "no datagram that comes is signed by its sender: swarm.members[].public_key is not the same "
      "on all robots, or net.robot_key_file of the others is another";
  constexpr const char* kOtherVersion =
      "no datagram that comes is of this version: install the same version of crepesd on all "
      "robots";
  const MeshCounters& totals = link.counters();
  const auto since = [](std::uint64_t& last, std::uint64_t total) {
    return total - std::exchange(last, total);
  };
  const std::uint64_t received = since(received_, totals[MeshCounter::kReceived]);
  const std::uint64_t unopened = since(unopened_, totals.seal_refusals());
  const std::uint64_t wrong = since(unsigned_, totals.signature_refusals());
  const std::uint64_t other = since(other_version_, totals.version_refusals());
  const char* const fault = received == 0          ? ""
                            : unopened == received ? kOtherKey
                            : wrong == received    ? kOtherSigner
                            : other == received    ? kOtherVersion
                                                   : "";
  fault_ = fault;
  if (received == 0 || fault_ == logged_) return;  // silence shows nothing of keys
  log_message(fault_.empty() ? LogLevel::kInfo : LogLevel::kWarning,
              "mesh: " + (fault_.empty() ? std::string("works again") : fault_));
  logged_ = fault_;
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
