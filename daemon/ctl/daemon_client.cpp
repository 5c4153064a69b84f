#include "daemon/ctl/daemon_client.hpp"

#include <utility>

namespace crepes {
namespace {

/// The local address from which `daemon` can be reached.
std::string local_address_for(const Endpoint& daemon) {
  if (daemon.is_ipv4()) return daemon.is_loopback() ? "127.0.0.1" : "0.0.0.0";
  return daemon.is_loopback() ? "::1" : "::";
}

}  // namespace

Result<DaemonClient> DaemonClient::open(const std::string& address, std::uint16_t port) {
  const std::optional<Endpoint> daemon = Endpoint::parse(address, port);
  if (!daemon)
    return fail(ErrorCode::kUsage, "'" + address + "' is not a numeric IPv4 or IPv6 address");
  return UdpSocket::bind(local_address_for(*daemon), 0).map([&](UdpSocket&& socket) {
    return DaemonClient(std::move(socket), *daemon);
  });
}

Error silent(const DaemonAddress& daemon) {
  return {ErrorCode::kNotFound, "no answer from " + daemon.address + " port " +
                                    std::to_string(daemon.port) + ": is crepesd running there?"};
}

Result<void> DaemonClient::watch() { return ask(R"({"class":"WATCH","enable":true)"); }
Result<void> DaemonClient::unwatch() { return ask(R"({"class":"WATCH","enable":false)"); }
Result<void> DaemonClient::poll() { return ask(R"({"class":"POLL")"); }
Result<void> DaemonClient::poll(RobotId neighbor) {
  return ask(R"({"class":"POLL","peer":)" + std::to_string(neighbor.value));
}
Result<void> DaemonClient::poll(std::string_view part) {
  return ask(R"({"class":"POLL","about":")" + std::string(part) + "\"");
}

Result<void> DaemonClient::ask(const std::string& request) {
  constexpr std::size_t kMaxUnanswered = 4;
  if (cookie_.empty() && unanswered_.size() < kMaxUnanswered) unanswered_.push_back(request);
  return send(request);
}

/// Room for the cookie, or the cookie: a daemon elsewhere gives none for a shorter request.
Result<void> DaemonClient::send(const std::string& request) {
  constexpr std::size_t kCookieAnswer = 64;
  const std::string end = cookie_.empty() ? R"(,"pad":")" + std::string(kCookieAnswer, ' ') + "\"}"
                                          : R"(,"cookie":")" + cookie_ + "\"}";
  const std::string text = request + end;
  return socket_.send_to(std::vector<std::uint8_t>(text.begin(), text.end()), daemon_);
}

/// What gets lost here is asked again by whoever waits for it.
void DaemonClient::take_cookie(const std::string& cookie) {
  cookie_ = cookie;
  for (const std::string& request : std::exchange(unanswered_, {})) (void)send(request);
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
  if (const auto* cookie = std::get_if<CookieMessage>(&*message)) {
    take_cookie(cookie->cookie);
    return std::nullopt;
  }
  unanswered_.clear();
  answer.message = std::move(*message);
  return answer;
}

}  // namespace crepes
