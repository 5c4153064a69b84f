/// Whole daemons in this process, seen from outside: over their sockets and serial lines alone.
#include "tests/support/live_daemon.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/runtime.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/pseudo_terminal.hpp"

namespace crepes::live_daemon_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_F(LiveDaemon, LocatesEachOtherThoughTheirClocksDiffer) {
  const Config first = pair_config(1, mesh_port_);
  Config second = pair_config(2, mesh_port_);
  second.sim.clock_offset_s = 7.25;
  second.sim.clock_skew_ppm = 40.0;
  auto runtime_1 = std::make_unique<Runtime>(first, machine_);
  auto runtime_2 = std::make_unique<Runtime>(second, machine_);

  expect_true_poses(first);
  expect_true_poses(second);
  const SimClock clock_1(machine_, first.sim);
  const SimClock clock_2(machine_, second.sim);
  EXPECT_TRUE(Client(first).await_status([&](const Json& status) {
    if (status["clocks"].empty()) return false;
    const double offset_s = to_seconds(clock_2.now() - clock_1.now());
    return std::abs(status["clocks"][0]["offset_s"].get<double>() - offset_s) < 1e-3;
  }));

  const Timestamp asked = machine_.now();
  runtime_1.reset();
  runtime_2.reset();
  EXPECT_LT(machine_.now() - asked, seconds{2});  // one each
}

TEST_F(LiveDaemon, OpensASerialDeviceThatComesGoesAndComesAgain) {
  const std::filesystem::path port =
      std::filesystem::path(::testing::TempDir()) / ("crepes-imu-" + std::to_string(mesh_port_));
  Config config = without_devices(mesh_port_);
  config.imu.device.port = port;
  const Runtime runtime(config, machine_);
  Client client(config);
  auto sample = [turn = 0]() mutable {  // what repeats itself is taken for stuck
    return encode_witmotion({0.01 * (++turn % 100), 0.2, 0.3}, {0.0, 0.0, 9.81});
  };
  const auto missing = [](const Json& status) {
    return mentions(sensor_of(status, "imu"), "crepes-imu-");
  };

  EXPECT_TRUE(client.await_status(missing));
  for (int time = 0; time < 2; ++time) {
    PseudoTerminal device = PseudoTerminal::open().value();
    std::filesystem::create_symlink(device.path(), port);
    EXPECT_TRUE(client.await_status([&](const Json& status) {
      device.write(sample());
      const Json imu = sensor_of(status, "imu");
      return imu.value("ok", false) && imu.value("rate_hz", 0.0) > 0.0;
    }));
    std::filesystem::remove(port);
    device = PseudoTerminal::open().value();  // hangs up on the reader
    EXPECT_TRUE(client.await_status(missing));
  }
}

TEST_F(LiveDaemon, ReportsThatTheMeshInterfaceIsNotThereAndGoesOn) {
  Config config = pair_config(1, mesh_port_);
  config.net.interface = "nosuch0";
  const Runtime runtime(config, machine_);

  EXPECT_TRUE(Client(config).await_status([](const Json& status) {
    return mentions(sensor_of(status, "mesh"), "nosuch0") &&
           sensor_of(status, "imu").value("ok", false) &&
           status["neighbors"][0]["reason"] == "never heard";
  }));
}

TEST_F(LiveDaemon, ServesAnAddressAsSoonAsItCan) {
  Config config = without_devices(mesh_port_);
  config.subscription.listen = {"127.0.0.2", "127.0.0.1"};
  const auto port = static_cast<std::uint16_t>(config.subscription.port);
  std::optional<UdpSocket> other = UdpSocket::bind("127.0.0.2", port).value();
  const Runtime runtime(config, machine_);
  Client client(config);
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return mentions(sensor_of(status, "subscription"), "127.0.0.2") &&
           sensor_of(status, "subscription")["message"].get<std::string>().find("127.0.0.1") ==
               std::string::npos;
  }));

  other.reset();

  EXPECT_TRUE(client.await_status(
      [](const Json& status) { return sensor_of(status, "subscription").empty(); }));
  EXPECT_TRUE(Client(config, {127, 0, 0, 2}).await_status([](const Json&) { return true; }));
}

TEST_F(LiveDaemon, CountsForeignDatagramsAndAnswersFoolishRequests) {
  const Config config = without_devices(mesh_port_);
  const Runtime runtime(config, machine_);
  Client client(config);
  UdpSocket stranger =
      UdpSocket::open_broadcast("lo", static_cast<std::uint16_t>(mesh_port_)).value();
  const std::vector<std::uint8_t> noise(200, 0x5a);

  EXPECT_TRUE(client.await("\xff{not json", "ERROR", [](const Json& error) {
    return !error["message"].get<std::string>().empty();
  }));
  EXPECT_TRUE(client.await_status([&](const Json& status) {
    EXPECT_TRUE(stranger.broadcast(noise));
    return status["network"].value("refused_foreign", 0) > 0 &&
           status["network"].value("requests_refused", 0) > 0;
  }));
}

}  // namespace
}  // namespace crepes::live_daemon_test
