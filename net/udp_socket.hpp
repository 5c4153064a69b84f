/// UDP sockets that own their descriptor and say what went wrong and what to do.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "estimator/core/result.hpp"
#include "net/endpoint.hpp"

namespace crepes {

struct Datagram {
  /// Cut at UdpSocket::kMaxDatagram; a longer one shows as exactly that many bytes.
  std::vector<std::uint8_t> bytes;
  Endpoint from;
};

class UdpSocket {
 public:
  /// More than any datagram that this project accepts.
  static constexpr std::size_t kMaxDatagram = 2048;

  /// Sends to and hears the broadcast address of the interface (`lo`: 127.255.255.255, heard by all
  /// processes of this machine). Several sockets may share the port; each hears all, itself too.
  [[nodiscard]] static Result<UdpSocket> open_broadcast(const std::string& interface,
                                                        std::uint16_t port);

  /// A socket bound to one numeric IPv4 or IPv6 address; port 0 lets the system choose.
  [[nodiscard]] static Result<UdpSocket> bind(const std::string& address, std::uint16_t port);

  UdpSocket(UdpSocket&& other) noexcept;
  UdpSocket& operator=(UdpSocket&& other) noexcept;
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;
  ~UdpSocket();

  /// To everyone on the interface; only for sockets of open_broadcast. kBusy when it is congested:
  /// lost, as any datagram may be. After other errors, open again.
  [[nodiscard]] Result<void> broadcast(std::span<const std::uint8_t> bytes);
  /// Never waits: what the system cannot take now is an Error, kBusy.
  [[nodiscard]] Result<void> send_to(std::span<const std::uint8_t> bytes, const Endpoint& to);
  /// The next datagram, or nothing within `timeout`.
  [[nodiscard]] Result<std::optional<Datagram>> receive(std::chrono::milliseconds timeout);

  /// The address this socket is bound to.
  [[nodiscard]] const Endpoint& local() const { return local_; }
  /// For poll(2) over several sockets; remains owned by this object.
  [[nodiscard]] int descriptor() const { return fd_; }

 private:
  [[nodiscard]] static Result<UdpSocket> open(const Endpoint& address, std::string name,
                                              bool broadcast);
  UdpSocket(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}

  int fd_ = -1;
  std::string name_;  ///< how errors call it
  Endpoint local_;
};

}  // namespace crepes
