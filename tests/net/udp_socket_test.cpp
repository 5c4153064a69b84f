#include "net/udp_socket.hpp"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <optional>
#include <thread>

namespace crepes::udp_socket_test {
namespace {

using std::chrono::milliseconds;

constexpr std::array<std::uint8_t, 3> kBytes{1, 2, 3};

/// A port that other runs of this test are unlikely to use.
std::uint16_t some_port() { return static_cast<std::uint16_t>(20000 + ::getpid() % 20000); }

std::vector<std::uint8_t> received_by(UdpSocket& socket) {
  const auto datagram = socket.receive(milliseconds{1000});
  return datagram && *datagram ? (*datagram)->bytes : std::vector<std::uint8_t>{};
}

TEST(UdpSocket, IsReceivedByAllSocketsOfTheBroadcastPort) {
  auto first = UdpSocket::open_broadcast("lo", some_port());
  auto second = UdpSocket::open_broadcast("lo", some_port());
  auto third = UdpSocket::open_broadcast("lo", some_port());
  ASSERT_TRUE(first && second && third) << (first ? "" : first.error().message);

  ASSERT_TRUE(second->broadcast(kBytes));

  for (UdpSocket* socket : {&*first, &*second, &*third})
    EXPECT_EQ(received_by(*socket), std::vector<std::uint8_t>(kBytes.begin(), kBytes.end()));
}

class Unicast : public testing::TestWithParam<const char*> {};

TEST_P(Unicast, AnswersTheSenderOfADatagram) {
  auto server = UdpSocket::bind(GetParam(), 0);
  auto guest = UdpSocket::bind(GetParam(), 0);
  if (!server) GTEST_SKIP() << server.error().message;
  ASSERT_TRUE(guest->send_to(kBytes, server->local()));

  const auto request = server->receive(milliseconds{1000});
  ASSERT_TRUE(request && *request);
  ASSERT_TRUE(server->send_to((*request)->bytes, (*request)->from));

  EXPECT_TRUE((*request)->from.is_loopback());
  EXPECT_EQ((*request)->from, guest->local());
  EXPECT_EQ(received_by(*guest).size(), kBytes.size());
}

INSTANTIATE_TEST_SUITE_P(Families, Unicast, testing::Values("127.0.0.1", "::1"));

TEST(UdpSocket, ReturnsNothingWhenNothingArrives) {
  auto socket = UdpSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket);

  const auto datagram = socket->receive(milliseconds{1});

  ASSERT_TRUE(datagram);
  EXPECT_FALSE(datagram->has_value());
}

TEST(UdpSocket, KeepsABurstUntilItIsRead) {
  constexpr int kBurst = 400;  // the kernel's default buffer holds 277 small ones
  auto server = UdpSocket::bind("127.0.0.1", 0);
  auto guest = UdpSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(server && guest);

  for (int i = 0; i < kBurst; ++i) ASSERT_TRUE(guest->send_to(kBytes, server->local()));

  int received = 0;
  for (int i = 0; i < kBurst; ++i) received += received_by(*server).empty() ? 0 : 1;
  EXPECT_EQ(received, kBurst);
}

TEST(UdpSocket, TruncatesHugeDatagrams) {
  auto socket = UdpSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket);
  ASSERT_TRUE(socket->send_to(std::vector<std::uint8_t>(60000), socket->local()));

  EXPECT_EQ(received_by(*socket).size(), UdpSocket::kMaxDatagram);
}

TEST(UdpSocket, NamesCauseAndRemedy) {
  auto holder = UdpSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(holder);

  const auto taken = UdpSocket::bind("127.0.0.1", holder->local().port);
  const auto missing = UdpSocket::open_broadcast("nosuch0", 47474);
  const auto foreign = UdpSocket::bind("192.0.2.1", 47475);
  const auto name = UdpSocket::bind("localhost", 47475);

  ASSERT_TRUE(!taken && !missing && !foreign && !name);
  EXPECT_NE(taken.error().message.find("another program"), std::string::npos);
  EXPECT_NE(taken.error().message.find("127.0.0.1:"), std::string::npos);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_NE(missing.error().message.find("nosuch0: no such interface"), std::string::npos);
  EXPECT_NE(foreign.error().message.find("does not have the address"), std::string::npos);
  EXPECT_NE(name.error().message.find("not a numeric"), std::string::npos);
}

TEST(UdpSocket, ReportsWhatItCannotSend) {
  auto socket = UdpSocket::bind("127.0.0.1", 0);
  ASSERT_TRUE(socket);

  const auto sent = socket->send_to(std::vector<std::uint8_t>(70000), socket->local());

  ASSERT_FALSE(sent);
  EXPECT_NE(sent.error().message.find("send to 127.0.0.1:"), std::string::npos);
  EXPECT_EQ(sent.error().code, ErrorCode::kIo);
}

/// Runs the commands in a network of the calling thread's own.
bool have_network(const std::string& commands) {
  return ::unshare(CLONE_NEWNET) == 0 &&
         std::system(commands.c_str()) == 0;  // NOLINT(concurrency-mt-unsafe)
}

// The mesh's interface and another one, by which everything else goes.
TEST(UdpSocket, ReachesTheNetworkOfItsInterfaceAndNothingElse) {
  bool is_permitted = false;
  std::thread([&] {
    is_permitted = have_network(
        "ip link add mesh0 type veth peer mesh1 && ip link add up0 type veth peer up1 && "
        "ip address add 10.9.0.1/24 dev mesh0 && ip address add 192.168.50.1/24 dev up0 && "
        "ip link set mesh1 up && ip link set up1 up && "
        "ip link set mesh0 up && ip link set up0 up && ip route add default via 192.168.50.2 && "
        "timeout 5 sh -c \"until ip link show mesh0 | grep -q 'state UP'; do sleep 0.01; done\"");
    if (!is_permitted) return;
    auto socket = UdpSocket::open_broadcast("mesh0", some_port());
    ASSERT_TRUE(socket) << socket.error().message;
    EXPECT_EQ(socket->local().to_string(), "10.9.0.255:" + std::to_string(socket->local().port))
        << "though the address was given without a broadcast address";
    EXPECT_TRUE(socket->broadcast(std::vector<std::uint8_t>(10)));

    ASSERT_EQ(std::system("ip link delete mesh0"), 0);  // NOLINT(concurrency-mt-unsafe)
    const auto sent = socket->broadcast(std::vector<std::uint8_t>(10));
    ASSERT_FALSE(sent);
    EXPECT_NE(sent.error().code, ErrorCode::kBusy);
  }).join();
  if (!is_permitted) GTEST_SKIP() << "needs root and ip(8) for a network of its own";
}

TEST(UdpSocket, DoesNotOpenWithoutACarrier) {
  bool is_permitted = false;
  std::optional<Error> refusal;
  std::thread([&] {
    is_permitted = have_network(
        "ip link add mesh0 type veth peer mesh1 && ip link set mesh0 up && "
        "ip address add 10.9.0.1/24 dev mesh0");
    if (!is_permitted) return;
    const auto socket = UdpSocket::open_broadcast("mesh0", some_port());
    if (!socket) refusal = socket.error();
  }).join();
  if (!is_permitted) GTEST_SKIP() << "needs root and ip(8) for a network of its own";

  ASSERT_TRUE(refusal);
  EXPECT_NE(refusal->message.find("no carrier"), std::string::npos) << refusal->message;
}

TEST(UdpSocket, AnswersFromTheAddressThatWasAsked) {
  for (const auto& [all, asked] : {std::pair("0.0.0.0", "127.0.0.7"), std::pair("::", "::1"),
                                   std::pair("127.0.0.8", "127.0.0.8")}) {
    auto server = UdpSocket::bind(all, 0);
    auto client = UdpSocket::bind(all[0] == ':' ? "::1" : "127.0.0.1", 0);
    if (!server && all[0] == ':') continue;  // a machine without IPv6
    ASSERT_TRUE(server && client);
    const Endpoint at = Endpoint::parse(asked, server->local().port).value();
    ASSERT_TRUE(client->send_to(kBytes, at));
    const auto request = server->receive(milliseconds{1000});
    ASSERT_TRUE(request && *request);

    ASSERT_TRUE(server->send_to(kBytes, (*request)->from, (*request)->to));

    const auto answer = client->receive(milliseconds{1000});
    ASSERT_TRUE(answer && *answer);
    EXPECT_EQ((*answer)->from.to_string(), at.to_string()) << all;
  }
}

// On a link of its own that passes a kilobyte a second.
TEST(UdpSocket, DistinguishesACongestedLinkFromABrokenOne) {
  bool is_permitted = false;
  std::optional<Error> refusal;
  std::thread([&] {
    is_permitted = have_network(
        "ip link set lo up && "
        "tc qdisc add dev lo root tbf rate 8kbit burst 3000 limit 9999999");
    if (!is_permitted) return;
    auto socket = UdpSocket::open_broadcast("lo", some_port());
    ASSERT_TRUE(socket);
    for (int i = 0; i < 10000 && !refusal; ++i) {
      const auto sent = socket->broadcast(std::vector<std::uint8_t>(1000));
      if (!sent) refusal = sent.error();
    }
  }).join();
  if (!is_permitted) GTEST_SKIP() << "needs root and tc(8) for a network of its own";

  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ErrorCode::kBusy) << refusal->message;
}

}  // namespace
}  // namespace crepes::udp_socket_test
