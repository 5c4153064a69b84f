#include "daemon/ctl/view/http_server.hpp"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <string>
#include <utility>

#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/unique_fd.hpp"

namespace crepes::http_server_test {
namespace {

using namespace std::chrono_literals;

/// A browser's end of a connection, which never waits.
class Client {
 public:
  explicit Client(std::uint16_t port)
      : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    constexpr int kSmall = 4096;
    ::setsockopt(socket_.get(), SOL_SOCKET, SO_RCVBUF, &kSmall, sizeof(kSmall));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    // NOLINTNEXTLINE(*-reinterpret-cast): the socket's interface
    ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  }

  bool send(const std::string& text) const {
    return ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(text.size());
  }

  /// What has arrived.
  std::string read() {
    std::string text;
    std::array<char, 65536> part{};
    ssize_t size = 0;
    while ((size = ::recv(socket_.get(), part.data(), part.size(), 0)) > 0)
      text.append(part.data(), static_cast<std::size_t>(size));
    is_closed_ = is_closed_ || size == 0 || (errno != EAGAIN && errno != ENOTCONN);
    return text;
  }

  [[nodiscard]] bool is_closed() const { return is_closed_; }

 private:
  UniqueFd socket_;
  bool is_closed_ = false;
};

HttpServer server_with(Duration request_time, HttpServer::Answer answer) {
  auto server = HttpServer::open(
      {.address = "127.0.0.1", .port = 0, .name = "test", .request_time = request_time},
      std::move(answer));
  EXPECT_TRUE(server) << server.error().message;
  return std::move(*server);
}

constexpr auto kRequest = "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
constexpr Duration kPatience = 30s;  // for a busy machine

TEST(HttpServer, TellsAReaderThatFellBehindAllAnewOnceItReadsAgain) {
  std::string state = "first";
  HttpServer server = server_with(
      5s, [&](const HttpRequest&) { return HttpReply{.body = "[" + state + "]", .topic = 0}; });
  Client reader(server.port());
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  const std::string flood(100'000, '.');
  constexpr int kFlood = 100;  // 10 MB, more than all buffers on the way
  int published = 0;
  bool is_sent = false;
  std::string received;

  server.serve(1ms, [&] {
    if (!is_sent) is_sent = reader.send(kRequest);
    if (server.readers(0) == 0) return clock.now() - start < kPatience;
    if (published++ < kFlood) {
      server.publish(0, flood);
      return true;
    }
    if (std::exchange(state, "second") != "second") server.publish(0, "[second]");  // it is full
    received += reader.read();
    server.publish(0, ":");
    return received.find("[second]") == std::string::npos && clock.now() - start < kPatience;
  });

  EXPECT_NE(received.find("[first]"), std::string::npos);
  EXPECT_NE(received.find("[second]:"), std::string::npos);
  EXPECT_LT(received.size(), 5'000'000U);  // most of the flood was never kept for it
}

TEST(HttpServer, ClosesAConnectionWhoseRequestTricklesIn) {
  constexpr Duration kRequestTime = 200ms;
  HttpServer server = server_with(kRequestTime, [](const HttpRequest&) { return HttpReply{}; });
  Client slow(server.port());
  const std::string request = "GET / HTTP/1.1\r\nX-Slow: " + std::string(1000, 'a');
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  std::size_t sent = 0;
  Timestamp next = start;

  server.serve(5ms, [&] {
    if (clock.now() >= next && sent < request.size() && slow.send(request.substr(sent, 1))) {
      ++sent;
      next = clock.now() + 40ms;  // five times within the limit
    }
    (void)slow.read();
    return !slow.is_closed() && clock.now() - start < kPatience;
  });

  EXPECT_TRUE(slow.is_closed());
  EXPECT_GE(clock.now() - start, kRequestTime);
  EXPECT_LT(sent, 500U);  // 20 s of them
}

TEST(HttpServer, LeavesAReplyThatIsOnItsWayAlone) {
  HttpServer server = server_with(
      100ms, [](const HttpRequest&) { return HttpReply{.body = "stream", .topic = 0}; });
  Client reader(server.port());
  const MonotonicClock clock;
  const Timestamp start = clock.now();
  Timestamp opened = Timestamp::max();
  bool is_sent = false;

  server.serve(5ms, [&] {
    if (!is_sent) is_sent = reader.send(kRequest);
    if (opened == Timestamp::max() && server.readers(0) == 1) opened = clock.now();
    (void)reader.read();
    const bool is_over = opened != Timestamp::max() && clock.now() - opened > 500ms;
    return !is_over && clock.now() - start < kPatience;
  });

  EXPECT_EQ(server.readers(0), 1U);
}

}  // namespace
}  // namespace crepes::http_server_test
