#include "net/client/daemon_client.hpp"

#include <fmt/core.h>

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
  if (!daemon) {
    return fail(ErrorCode::kUsage,
                fmt::format("'{}' is not a numeric IPv4 or IPv6 address", address));
  }
  return UdpSocket::bind(local_address_for(*daemon), 0).map([&](UdpSocket&& socket) {
    return DaemonClient(std::move(socket), *daemon);
  });
}

Error no_answer_from(const DaemonAddress& daemon) {
  return {ErrorCode::kNotFound, fmt::format("no answer from {} port {}: is crepesd running there?",
                                            daemon.address, daemon.port)};
}

Result<void> DaemonClient::watch() { return ask(R"({"class":"WATCH","enable":true)"); }
Result<void> DaemonClient::unwatch() { return ask(R"({"class":"WATCH","enable":false)"); }
Result<void> DaemonClient::poll() { return ask(R"({"class":"POLL")"); }
Result<void> DaemonClient::poll(RobotId neighbor) {
  return ask(fmt::format(R"({{"class":"POLL","peer":{})", neighbor.value));
}
Result<void> DaemonClient::poll(std::string_view part) {
  return ask(fmt::format(R"({{"class":"POLL","about":"{}")", part));
}

Result<void> DaemonClient::ask(const std::string& request) {
  constexpr std::size_t kMaxUnanswered = 4;
  if (cookie_.empty() && unanswered_.size() < kMaxUnanswered) unanswered_.push_back(request);
  return send(request);
}

/// Adds the cookie, or padding: a remote daemon sends no cookie in reply to a shorter request.
Result<void> DaemonClient::send(const std::string& request) {
  constexpr std::size_t kCookieAnswer = 64;
  const std::string end = cookie_.empty() ? fmt::format(R"(,"pad":"{:{}}"}})", "", kCookieAnswer)
                                          : fmt::format(R"(,"cookie":"{}"}})", cookie_);
  const std::string text = request + end;
  return socket_.send_to(std::vector<std::uint8_t>(text.begin(), text.end()), daemon_);
}

/// A lost request is repeated by the caller that waits for its answer.
void DaemonClient::store_cookie(const std::string& cookie) {
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
    store_cookie(cookie->cookie);
    return std::nullopt;
  }
  unanswered_.clear();
  answer.message = std::move(*message);
  return answer;
}

}  // namespace crepes
