#include "daemon/ctl/daemon_client.hpp"

#include <arpa/inet.h>

namespace crepes {
namespace {

Result<Endpoint> endpoint_of(const std::string& address, std::uint16_t port) {
  std::array<std::uint8_t, 4> ipv4{};
  if (::inet_pton(AF_INET, address.c_str(), ipv4.data()) == 1) return Endpoint::ipv4(ipv4, port);
  Endpoint endpoint;
  endpoint.port = port;
  if (::inet_pton(AF_INET6, address.c_str(), endpoint.address.data()) == 1) return endpoint;
  return fail(ErrorCode::kUsage, "'" + address + "' is not a numeric IPv4 or IPv6 address");
}

/// The local address from which `daemon` can be reached.
std::string local_address_for(const Endpoint& daemon) {
  if (daemon.is_ipv4()) return daemon.is_loopback() ? "127.0.0.1" : "0.0.0.0";
  return daemon.is_loopback() ? "::1" : "::";
}

}  // namespace

Result<DaemonClient> DaemonClient::open(const std::string& address, std::uint16_t port) {
  const Result<Endpoint> daemon = endpoint_of(address, port);
  if (!daemon) return tl::unexpected(daemon.error());
  return UdpSocket::bind(local_address_for(*daemon), 0).map([&](UdpSocket&& socket) {
    return DaemonClient(std::move(socket), *daemon);
  });
}

Result<void> DaemonClient::watch() { return send(R"({"class":"WATCH","enable":true})"); }
Result<void> DaemonClient::unwatch() { return send(R"({"class":"WATCH","enable":false})"); }
Result<void> DaemonClient::poll() { return send(R"({"class":"POLL"})"); }

Result<void> DaemonClient::send(std::string_view request) {
  const std::vector<std::uint8_t> bytes(request.begin(), request.end());
  return socket_.send_to(bytes, daemon_);
}

Result<std::optional<DaemonAnswer>> DaemonClient::receive(std::chrono::milliseconds timeout) {
  const Result<std::optional<Datagram>> datagram = socket_.receive(timeout);
  if (!datagram) return tl::unexpected(datagram.error());
  if (!*datagram || (*datagram)->from != daemon_) return std::nullopt;
  DaemonAnswer answer{.text = {(*datagram)->bytes.begin(), (*datagram)->bytes.end()},
                      .message = {}};
  Result<DaemonMessage> message = parse_message(answer.text);
  if (!message) {
    ++malformed_;
    return std::nullopt;
  }
  answer.message = std::move(*message);
  return answer;
}

}  // namespace crepes
