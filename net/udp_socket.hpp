/// UDP sockets. Errors name the cause and the remedy.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/result.hpp"
#include "net/endpoint.hpp"

namespace crepes {

/// The bytes of a datagram and its source.
struct Datagram {
  /// Truncated at UdpSocket::kMaxDatagram bytes.
  std::vector<std::uint8_t> bytes;
  Endpoint from;
  /// This machine's address that it was sent to, if the socket serves all.
  std::optional<Endpoint> to{};
};

class UdpSocket {
 public:
  /// Larger than any datagram that this project accepts.
  static constexpr std::size_t kMaxDatagram = 2048;

  /// Sends to the broadcast address of the interface, and receives from it. `lo` means
  /// 127.255.255.255, which all processes of this machine receive. Several sockets may share the
  /// port: each receives every datagram, its own included.
  [[nodiscard]] static Result<UdpSocket> open_broadcast(const std::string& interface,
                                                        std::uint16_t port);

  /// Where such a socket sends now; its interface may get another address. An interface that is
  /// down or has no carrier is an error, though the system would lose what is sent in silence.
  [[nodiscard]] static Result<Endpoint> broadcast_address(const std::string& interface,
                                                          std::uint16_t port);

  /// A socket bound to one numeric IPv4 or IPv6 address; port 0 lets the system choose.
  [[nodiscard]] static Result<UdpSocket> bind(const std::string& address, std::uint16_t port);

  /// Sends to all hosts on the interface; only for sockets of open_broadcast. kBusy: the interface
  /// is congested and the datagram is lost. After other errors, open the socket again.
  [[nodiscard]] Result<void> broadcast(std::span<const std::uint8_t> bytes);
  /// Never blocks. kBusy: the system cannot send now. `from`: the one of this machine's addresses
  /// that the receiver sees; if empty, the system chooses.
  [[nodiscard]] Result<void> send_to(std::span<const std::uint8_t> bytes, const Endpoint& to,
                                     const std::optional<Endpoint>& from = {});
  /// The next datagram, or nothing within `timeout`.
  [[nodiscard]] Result<std::optional<Datagram>> receive(std::chrono::milliseconds timeout);

  /// The address this socket is bound to.
  [[nodiscard]] const Endpoint& local() const { return local_; }
  /// For poll(2); this object keeps ownership.
  [[nodiscard]] int descriptor() const { return fd_.get(); }

 private:
  [[nodiscard]] static Result<UdpSocket> open(const Endpoint& address, std::string name,
                                              bool broadcast);
  UdpSocket(UniqueFd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}

  UniqueFd fd_;
  std::string name_;  ///< in error messages
  Endpoint local_;
};

}  // namespace crepes
