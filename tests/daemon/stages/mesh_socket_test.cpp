#include "daemon/stages/mesh_socket.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <chrono>
#include <cstdlib>
#include <thread>
#include <vector>

#include "config/keys/mesh_key.hpp"
#include "daemon/service/logging.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::mesh_socket_test {
namespace {

using std::chrono::milliseconds;

NetConfig loopback() {
  NetConfig config;
  config.interface = "lo";
  config.port = free_port();
  return config;
}

TEST(MeshSocket, BacksOffWhileItOpensButCannotSend) {
  const LogSession log(LogLevel::kError);
  MeshSocket mesh(loopback());
  const Error refused{ErrorCode::kIo, "send: Operation not permitted"};
  Timestamp now{};
  ASSERT_NE(mesh.get(now), nullptr);
  mesh.close_for_retry(refused, now);
  now += milliseconds{100};
  ASSERT_NE(mesh.get(now), nullptr);
  EXPECT_EQ(mesh.fault(), refused.message);

  mesh.close_for_retry(refused, now);

  EXPECT_EQ(mesh.get(now + milliseconds{199}), nullptr);
  now += milliseconds{200};
  ASSERT_NE(mesh.get(now), nullptr);
  EXPECT_EQ(mesh.fault(), refused.message);

  mesh.end_fault();

  EXPECT_EQ(mesh.fault(), "");
  mesh.close_for_retry(refused, now);
  EXPECT_NE(mesh.get(now + milliseconds{100}), nullptr);
}

TEST(MeshSocket, IsWellOnceOpenThoughNothingIsSent) {
  const LogSession log(LogLevel::kError);
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  NetConfig config = loopback();
  config.key_file = scratch.path() / "mesh.key";
  MeshSocket mesh(config);
  ASSERT_EQ(mesh.get(Timestamp{}), nullptr);
  ASSERT_NE(mesh.fault(), "");
  ASSERT_TRUE(write_mesh_key(config.key_file));

  EXPECT_NE(mesh.get(Timestamp{milliseconds{100}}), nullptr);

  EXPECT_EQ(mesh.fault(), "");
}

TEST(MeshSocket, IsWellAgainAfterASecondThoughNothingIsSent) {
  const LogSession log(LogLevel::kError);
  MeshSocket mesh(loopback());
  Timestamp now{};
  ASSERT_NE(mesh.get(now), nullptr);
  mesh.close_for_retry({ErrorCode::kIo, "lo: interface is down"}, now);
  now += milliseconds{100};
  ASSERT_NE(mesh.get(now), nullptr);

  mesh.follow_address(now + milliseconds{500});
  EXPECT_NE(mesh.fault(), "");
  mesh.follow_address(now + milliseconds{1000});

  EXPECT_EQ(mesh.fault(), "");
  EXPECT_NE(mesh.get(now + milliseconds{1000}), nullptr);
}

// As where DHCP answers after the robot gave itself an address.
TEST(MeshSocket, FollowsItsInterfaceToAnotherAddress) {
  const auto run = [](const char* command) {
    return std::system(command);  // NOLINT(concurrency-mt-unsafe)
  };
  const LogSession log(LogLevel::kError);
  bool is_permitted = false;
  std::thread([&] {
    is_permitted =
        ::unshare(CLONE_NEWNET) == 0 &&
        run("ip link add mesh0 type veth peer mesh1 && ip link set mesh1 up && "
            "ip link set mesh0 up && ip address add 169.254.5.6/16 dev mesh0 && "
            "timeout 5 sh -c \"until ip link show mesh0 | grep -q 'state UP'; do sleep 0.01; "
            "done\"") == 0;
    if (!is_permitted) return;
    NetConfig config;
    config.interface = "mesh0";
    MeshSocket mesh(config);
    Timestamp now{};
    ASSERT_NE(mesh.get(now), nullptr);
    mesh.follow_address(now);
    EXPECT_GE(mesh.descriptor(), 0) << "the same address";
    ASSERT_EQ(run("ip address delete 169.254.5.6/16 dev mesh0 && "
                  "ip address add 192.168.7.1/24 dev mesh0"),
              0);

    mesh.follow_address(now);

    ASSERT_NE(mesh.get(now), nullptr);
    EXPECT_EQ(mesh.get(now)->local().to_string(), "192.168.7.255:47474");
    EXPECT_EQ(mesh.fault(), "");
    ASSERT_EQ(run("ip address delete 192.168.7.1/24 dev mesh0"), 0);
    mesh.follow_address(now);
    EXPECT_NE(mesh.fault().find("no IPv4 address"), std::string::npos) << mesh.fault();
  }).join();
  if (!is_permitted) GTEST_SKIP() << "needs root and ip(8) for a network of its own";
}

TEST(KeyMismatchMonitor, NamesAnotherVersion) {
  const LogSession log(LogLevel::kError);
  PeerLink other(RobotId{2}, {RobotId{1}});
  PeerLink link(RobotId{1}, {RobotId{2}});
  Report report;
  report.sender = RobotId{2};
  std::vector<std::uint8_t> datagram = other.compose(report, Timestamp{}, {}, {});
  ++datagram.at(3);  // the version
  KeyMismatchMonitor monitor;
  (void)link.receive(datagram, Timestamp{}, {}, Endpoint::ipv4({10, 0, 0, 2}, 47474));

  monitor.update(link);

  EXPECT_NE(monitor.fault().find("version"), std::string::npos);
}

TEST(KeyMismatchMonitor, LogsWhenAFaultBeginsAndWhenDatagramsAreBelievedAgain) {
  testing::internal::CaptureStderr();
  {
    const LogSession log(LogLevel::kInfo);
    PeerLink other(RobotId{2}, {RobotId{1}});
    PeerLink link(RobotId{1}, {RobotId{2}});
    Report report;
    report.sender = RobotId{2};
    KeyMismatchMonitor monitor;
    const auto hear = [&](int of_another_version) {
      std::vector<std::uint8_t> datagram = other.compose(report, Timestamp{}, {}, {});
      datagram.at(3) = static_cast<std::uint8_t>(datagram.at(3) + of_another_version);
      (void)link.receive(datagram, Timestamp{}, {}, Endpoint::ipv4({10, 0, 0, 2}, 47474));
      monitor.update(link);
    };

    hear(1);
    monitor.update(link);  // silence ends no fault
    hear(1);
    hear(0);
    EXPECT_EQ(monitor.fault(), "");
  }
  const std::string log = testing::internal::GetCapturedStderr();

  const std::size_t begin = log.find("mesh: no datagram that comes is of this version");
  ASSERT_NE(begin, std::string::npos) << log;
  EXPECT_EQ(log.find("mesh: no datagram", begin + 1), std::string::npos) << log;
  EXPECT_NE(log.find("mesh: works again", begin), std::string::npos) << log;
}

}  // namespace
}  // namespace crepes::mesh_socket_test
