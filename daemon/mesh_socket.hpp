/// The way to the mesh, and what may be wrong with it.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"
#include "estimator/core/time.hpp"
#include "net/packet_seal.hpp"
#include "net/peer_link.hpp"
#include "net/udp_socket.hpp"

namespace crepes {

/// A socket and its seal, opened again when the interface comes and goes. While the key cannot be
/// read there is no socket: nothing leaves unsealed by mistake. Changes are logged.
class MeshSocket {
 public:
  explicit MeshSocket(NetConfig config) : config_(std::move(config)) {}

  /// Null while it cannot be opened; it is tried again after 0.1 s, at last every 5 s.
  [[nodiscard]] UdpSocket* get(Timestamp now);
  /// To be told of what the socket answers with an error.
  void failed(const Error& error, Timestamp now);

  [[nodiscard]] const std::optional<PacketSeal>& seal() const { return seal_; }
  /// Empty when all is well.
  [[nodiscard]] const std::string& fault() const { return fault_; }
  [[nodiscard]] int descriptor() const { return socket_ ? socket_->descriptor() : -1; }

 private:
  static constexpr Duration kFirstRetry = std::chrono::milliseconds{100};

  [[nodiscard]] Result<UdpSocket> open();

  NetConfig config_;
  std::optional<PacketSeal> seal_;
  std::optional<UdpSocket> socket_;
  std::string fault_;
  Timestamp retry_at_{};
  Duration retry_ = kFirstRetry;
};

/// Notices that datagrams come and not one of them can be opened.
class KeyWatch {
 public:
  /// Judges what came since the last look; once a second will do.
  void look(const PeerLink& link);
  /// Empty when all is well.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  std::uint64_t received_ = 0;
  std::uint64_t closed_ = 0;
  std::string fault_;
};

}  // namespace crepes
