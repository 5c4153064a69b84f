#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "net/client/client.hpp"

namespace crepes::client {
namespace {

using Time = Conversation::Time;

/// The library reads the clock by itself, because it is installed without the rest of the project.
Time now() { return std::chrono::steady_clock::now(); }

std::string text_of_error(int number) { return std::generic_category().message(number); }

/// The sockets' interface knows addresses of one type for all families.
sockaddr* any_family(sockaddr_in6& address) {
  return static_cast<sockaddr*>(static_cast<void*>(&address));
}

socklen_t size_of(const sockaddr_in6& address) {
  return address.sin6_family == AF_INET ? sizeof(sockaddr_in) : sizeof(sockaddr_in6);
}

/// Empty if this is no numeric address.
std::optional<sockaddr_in6> resolve(const Address& daemon) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(daemon.port);
  if (::getaddrinfo(daemon.address.c_str(), port.c_str(), &hints, &found) != 0) return std::nullopt;
  sockaddr_in6 address{};
  const bool fits = found->ai_addrlen <= sizeof address;
  if (fits) std::memcpy(&address, found->ai_addr, found->ai_addrlen);
  ::freeaddrinfo(found);
  return fits ? std::optional(address) : std::nullopt;
}

bool is_same(const sockaddr_in6& a, const sockaddr_in6& b) {
  if (a.sin6_family != b.sin6_family || a.sin6_port != b.sin6_port) return false;
  if (a.sin6_family == AF_INET6)
    return std::memcmp(&a.sin6_addr, &b.sin6_addr, sizeof a.sin6_addr) == 0;
  sockaddr_in x{};
  sockaddr_in y{};
  std::memcpy(&x, &a, sizeof x);
  std::memcpy(&y, &b, sizeof y);
  return x.sin_addr.s_addr == y.sin_addr.s_addr;
}

int milliseconds_until(Time end, Time now) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - now).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, 1000));
}

}  // namespace

std::optional<Connection> Connection::open(const Address& daemon, const Requests& requests,
                                           std::string& fault) {
  const std::optional<sockaddr_in6> address = resolve(daemon);
  if (!address) {
    fault = "'" + daemon.address + "' is not a numeric IPv4 or IPv6 address: names are not " +
            "resolved; say 127.0.0.1 for this machine";
    return std::nullopt;
  }
  // Not connected: its own address may change, and an absent daemon is no error of the socket.
  const int socket = ::socket(address->sin6_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) {
    fault = "no socket: " + text_of_error(errno);
    return std::nullopt;
  }
  return Connection(socket, *address, requests);
}

Connection::Connection(int socket, const sockaddr_in6& daemon, const Requests& requests)
    : socket_(socket), daemon_(daemon), conversation_(requests), opened_(now()) {}

Connection::Connection(Connection&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)),
      daemon_(other.daemon_),
      conversation_(std::move(other.conversation_)),
      opened_(other.opened_),
      send_errno_(other.send_errno_) {}

Connection& Connection::operator=(Connection&& other) noexcept {
  if (this == &other) return *this;
  close();
  socket_ = std::exchange(other.socket_, -1);
  daemon_ = other.daemon_;
  conversation_ = std::move(other.conversation_);
  opened_ = other.opened_;
  send_errno_ = other.send_errno_;
  return *this;
}

Connection::~Connection() { close(); }

void Connection::close() {
  if (socket_ < 0) return;
  if (const auto farewell = conversation_.farewell()) send(*farewell);
  ::close(std::exchange(socket_, -1));
}

/// What cannot be sent is asked for again, like what gets lost.
void Connection::send(const std::string& datagram) {
  const auto sent = ::sendto(socket_, datagram.data(), datagram.size(), MSG_NOSIGNAL,
                             any_family(daemon_), size_of(daemon_));
  send_errno_ = sent < 0 ? errno : 0;
}

std::string Connection::send_fault() const {
  return send_errno_ == 0 ? std::string() : text_of_error(send_errno_);
}

/// The next datagram; an empty one if it is of somebody else; none if there is none.
std::optional<std::string> Connection::read() {
  std::array<char, 2048> bytes{};
  sockaddr_in6 from{};
  socklen_t size = sizeof from;
  const auto received = ::recvfrom(socket_, bytes.data(), bytes.size(), 0, any_family(from), &size);
  if (received < 0) return std::nullopt;
  if (!is_same(from, daemon_)) return std::string();
  return std::string(bytes.data(), static_cast<std::size_t>(received));
}

/// The next message among the datagrams that have arrived.
std::optional<Answer> Connection::take_all(Time now) {
  constexpr int kMaxAtOnce = 1000;  // a flood of others must not keep the program
  for (int i = 0; i < kMaxAtOnce; ++i) {
    auto datagram = read();
    if (!datagram) break;
    if (datagram->empty()) continue;
    if (auto answer = conversation_.take(std::move(*datagram), now)) return answer;
  }
  return std::nullopt;
}

std::optional<Answer> Connection::receive(std::chrono::milliseconds timeout) {
  const Time end = now() + timeout;
  for (;;) {
    const Time before = now();
    for (const std::string& datagram : conversation_.due(before)) send(datagram);
    if (auto answer = take_all(before)) return answer;
    if (before >= end) return std::nullopt;
    pollfd ready{socket_, POLLIN, 0};
    const Time wake = std::min(end, conversation_.next_due());
    if (::poll(&ready, 1, milliseconds_until(wake, before)) < 0) return std::nullopt;
  }
}

std::chrono::duration<double> Connection::silent_for() const {
  return now() - conversation_.heard().value_or(opened_);
}

}  // namespace crepes::client
