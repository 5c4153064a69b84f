/// The socket to the mesh, and its faults.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "estimator/core/result.hpp"
#include "estimator/core/time.hpp"
#include "net/endpoint.hpp"
#include "net/mesh/mesh_config.hpp"
#include "net/mesh/packet_seal.hpp"
#include "net/mesh/packet_signature.hpp"
#include "net/mesh/peer_link.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

inline constexpr std::string_view kKeysUnlocked =
    "keys may be written to swap: their memory cannot be locked; raise LimitMEMLOCK (ulimit -l)";

/// A socket and its keys, reopened when the interface disappears and returns. While a key cannot be
/// read there is no socket, so nothing leaves unsealed or unsigned by mistake. Changes are logged.
class MeshSocket {
 public:
  explicit MeshSocket(NetConfig config) : config_(std::move(config)) {}

  /// Null while it cannot be opened. It is opened again after 0.1 s; the delay grows to 5 s, also
  /// while it opens but cannot be used.
  [[nodiscard]] UdpSocket* get(Timestamp now);
  /// Closes the socket after an error and schedules the next attempt.
  void close_for_retry(const Error& error, Timestamp now);
  /// Opens the socket anew if its interface has got another address, which no error shows: what is
  /// sent to the old one is lost. Ends the fault of a socket that has been open for a second. Once
  /// a second is enough.
  void follow_address(Timestamp now);
  /// Call it after a successful broadcast.
  void end_fault();

  [[nodiscard]] const std::optional<PacketSeal>& seal() const { return seal_; }
  [[nodiscard]] const std::optional<PacketSigner>& signer() const { return signer_; }
  /// The current fault; empty without one.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  /// True if the system does not lock the memory of a key.
  [[nodiscard]] bool keys_may_be_swapped() const {
    return (seal_ && !seal_->is_locked()) || (signer_ && !signer_->is_locked());
  }
  [[nodiscard]] int descriptor() const { return socket_ ? socket_->descriptor() : -1; }

 private:
  static constexpr Duration kFirstRetry = std::chrono::milliseconds{100};

  [[nodiscard]] std::uint16_t port() const { return static_cast<std::uint16_t>(config_.port); }
  [[nodiscard]] Result<UdpSocket> open();
  /// Returns what the log says of the keys; empty without any.
  [[nodiscard]] Result<std::string> read_keys();

  NetConfig config_;
  std::optional<PacketSeal> seal_;
  std::optional<PacketSigner> signer_;
  std::optional<UdpSocket> socket_;
  std::string fault_;
  Timestamp retry_at_ = kNever;
  Duration retry_ = kFirstRetry;
  Timestamp opened_{};
  bool failed_in_use_ = false;  ///< the current fault is one of an open socket
  std::string logged_keys_;
};

/// Detects that datagrams arrive but none of them is believed. Logs when that begins and ends.
class KeyMismatchMonitor {
 public:
  /// Checks the datagrams since the last update; once a second is enough.
  void update(const PeerLink& link);
  /// The current fault; empty without one.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  std::uint64_t received_ = 0;
  std::uint64_t unopened_ = 0;
  std::uint64_t unsigned_ = 0;
  std::uint64_t other_version_ = 0;
  std::string fault_;
  std::string logged_;  ///< the last fault in the log; empty if it has ended there
};

/// Detects that two robots use one id.
class DoubledIdMonitor {
 public:
  /// Call after each datagram, with its sender's address and arrival.
  void update(const PeerLink& link, const Endpoint& from, Timestamp arrival);
  /// The current fault; empty without one. It lasts five seconds longer than its cause.
  [[nodiscard]] std::string fault(Timestamp now) const;

 private:
  std::optional<Timestamp> last_;
  std::string fault_;
};

}  // namespace crepes
