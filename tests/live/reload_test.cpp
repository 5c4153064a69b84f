/// Whole daemons whose settings change while they run.
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "daemon/runtime.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "tests/support/live_daemon.hpp"
#include "tests/support/places.hpp"

namespace crepes::reload_test {
namespace {

using std::chrono::milliseconds;

class Reload : public LiveDaemon {
 protected:
  /// The median time between poses as they come; a busy machine skips one now and then.
  static double seconds_between_poses(const Config& config) {
    Client client(config);
    std::vector<double> apart;
    double last = 0.0;
    client.await(R"({"class":"WATCH"})", "POSE", [&](const Json& pose) {
      const double stamp = pose["timestamp"].get<double>();
      apart.push_back(stamp - std::exchange(last, stamp));
      return apart.size() > 20;
    });
    std::ranges::sort(apart);
    return apart.empty() ? 0.0 : apart[apart.size() / 2];
  }

  static std::uint64_t fused_ranges(const Json& status) {
    const Json neighbor = status["neighbors"].empty() ? Json::object() : status["neighbors"][0];
    return neighbor.value("measurements", Json::object())
        .value("range", Json::object())
        .value("fused", 0U);
  }
};

TEST_F(Reload, ChangesRatesNoiseAndLimitsWithoutLosingThePose) {
  const Config first = pair_config(1, mesh_port_);
  Runtime runtime(first, machine_);
  const Runtime other(pair_config(2, mesh_port_), machine_);
  expect_true_poses(first);
  Client subscriber(first);
  // No rival is on trial any more; where threads are instrumented, a filter may begin anew at any
  // time for want of time.
  const double kTrial = kIsSanitized ? 0.0 : 1.5;
  int starts = -1;
  double since = 0.0;
  ASSERT_TRUE(subscriber.await(R"({"class":"WATCH"})", "POSE", [&](const Json& pose) {
    const double now = pose["timestamp"].get<double>();
    const int before = std::exchange(starts, pose["reset_counter"].get<int>());
    if (starts != before) since = now;
    return now - since >= kTrial;
  }));
  Config wanted = first;
  wanted.estimator.output_rate_hz = 10;
  wanted.uwb.noise.noise_m = 0.2;
  wanted.imu.noise.gyroscope_noise_density *= 2;
  wanted.vision.gate_px = 10;
  wanted.graph.rate_hz = 5;
  wanted.net.report_rate_hz = 40;
  wanted.subscription.lease_s = 42;

  const Result<ConfigChange> change = runtime.reconfigure(wanted);

  ASSERT_TRUE(change) << change.error().message;
  EXPECT_EQ(change->live.size(), 7U);
  EXPECT_TRUE(change->restart.empty());
  EXPECT_TRUE(subscriber.await_status(
      [](const Json& status) { return status["config"]["generation"] == 2; }));
  EXPECT_TRUE(subscriber.await(R"({"class":"WATCH"})", "VERSION",
                               [](const Json& version) { return version["lease_s"] == 42; }));
  expect_true_poses(first);
  if (kIsSanitized) return;
  EXPECT_NEAR(seconds_between_poses(first), 0.1, 0.04);
  EXPECT_TRUE(subscriber.await(R"({"class":"WATCH"})", "POSE", [&](const Json& pose) {
    EXPECT_EQ(pose["reset_counter"], starts);  // the filter went on
    return true;
  }));
}

TEST_F(Reload, LetsMembersOutAndIn) {
  const Config both = pair_config(1, mesh_port_);
  Config alone = both;
  alone.swarm.members.resize(1);
  Runtime runtime(both, machine_);
  const Runtime other(pair_config(2, mesh_port_), machine_);
  Client client(both);
  expect_true_poses(both);

  ASSERT_TRUE(runtime.reconfigure(alone));
  ASSERT_TRUE(client.await_status([](const Json& status) {
    return status["neighbors"].empty() && status["network"].value("refused_unknown_sender", 0) > 0;
  }));

  ASSERT_TRUE(runtime.reconfigure(both));
  EXPECT_TRUE(client.await_status([](const Json& status) { return fused_ranges(status) > 0; }));
  expect_true_poses(both);
}

TEST_F(Reload, TakesTheKeyThatHasTakenTheOldOnesPlace) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::filesystem::path key = scratch.path() / "mesh.key";
  ASSERT_TRUE(write_mesh_key(key));
  std::array<Config, 2> configs{pair_config(1, mesh_port_), pair_config(2, mesh_port_)};
  for (Config& config : configs) config.net.key_file = key;
  Runtime one(configs[0], machine_);
  Runtime two(configs[1], machine_);
  expect_true_poses(configs[0]);

  std::filesystem::remove(key);
  ASSERT_TRUE(write_mesh_key(key));
  ASSERT_TRUE(one.reconfigure(configs[0]));
  for (const Config& config : configs) {
    EXPECT_TRUE(Client(config).await_status([](const Json& status) {
      return mentions(sensor_of(status, "mesh"), "net.key_file") &&
             status["network"].value("refused_seal_broken", 0) > 50;
    }));
  }

  ASSERT_TRUE(two.reconfigure(configs[1]));
  expect_true_poses(configs[0]);
  EXPECT_TRUE(Client(configs[0]).await_status([](const Json& status) {
    return sensor_of(status, "mesh").value("ok", false);
  }));
}

TEST_F(Reload, ExcludesALostRobotByOneLine) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const std::filesystem::path swarm_key = scratch.path() / "mesh.key";
  ASSERT_TRUE(write_mesh_key(swarm_key));
  std::array<Config, 2> configs{pair_config(1, mesh_port_), pair_config(2, mesh_port_)};
  std::array<std::string, 2> known;
  for (std::size_t i = 0; i < 2; ++i) {
    configs.at(i).net.key_file = swarm_key;
    configs.at(i).net.robot_key_file = scratch.path() / ("robot" + std::to_string(i));
    known.at(i) = to_text(public_key_of(write_robot_key(configs.at(i).net.robot_key_file).value()));
  }
  for (Config& config : configs) {
    for (std::size_t i = 0; i < 2; ++i) config.swarm.members.at(i).public_key = known.at(i);
  }
  Runtime one(configs[0], machine_);
  const Runtime two(configs[1], machine_);
  Client client(configs[0]);
  expect_true_poses(configs[0]);
  EXPECT_TRUE(client.await_status([](const Json& status) {
    const Json mesh = status.value("mesh", Json::object());
    return mesh.value("signed", false) && mesh.value("sealed", false) &&
           !mesh.contains("warning") && mesh.value("airtime_of_all", 0.0) > 0.01;
  }));

  Config excluding = configs[0];
  excluding.swarm.members.at(1).excluded = true;
  ASSERT_TRUE(one.reconfigure(excluding));
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return status["neighbors"][0].value("state", "") == "none" &&
           status["network"].value("refused_excluded", 0) > 50;
  }));

  ASSERT_TRUE(one.reconfigure(configs[0]));
  expect_true_poses(configs[0]);

  Config mistaken = configs[0];  // of another robot
  std::swap(mistaken.swarm.members.at(0).public_key, mistaken.swarm.members.at(1).public_key);
  ASSERT_TRUE(one.reconfigure(mistaken));
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return mentions(sensor_of(status, "mesh"), "public_key") &&
           status["network"].value("refused_signature_wrong", 0) > 50;
  }));
}

TEST_F(Reload, SendsNothingWhileItsKeyCannotBeRead) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  Config config = pair_config(1, mesh_port_);
  config.net.key_file = scratch.path() / "key";
  const Runtime runtime(config, machine_);
  Client client(config);

  const auto fault = client.await_status([](const Json& status) {
    return mentions(sensor_of(status, "mesh"), "No such file") &&
           sensor_of(status, "imu").value("counts", Json::object()).value("samples", 0) > 50;
  });
  ASSERT_TRUE(fault);
  EXPECT_EQ((*fault)["network"].value("sent", 0), 0);
  ASSERT_TRUE(write_mesh_key(config.net.key_file));

  EXPECT_TRUE(client.await_status([](const Json& status) {
    return sensor_of(status, "mesh").value("ok", false) && status["network"].value("sent", 0) > 0;
  }));
}

TEST_F(Reload, NamesWhatHasToWaitAndRefusesWhatCannotBe) {
  const Config first = pair_config(1, mesh_port_);
  Runtime runtime(first, machine_);
  Client client(first);
  Config wanted = first;
  wanted.cameras[0].calibration.rate_hz = 100;
  wanted.log.level = LogLevel::kWarning;
  ASSERT_TRUE(runtime.reconfigure(wanted));
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return status["config"].value("restart", "") == "cameras" &&
           status["config"]["generation"] == 2;
  }));

  wanted.robot.id = RobotId{2};  // which waits, and robot 1 is not in this swarm
  std::erase_if(wanted.swarm.members, [](const auto& member) { return member.id == RobotId{1}; });
  const Result<ConfigChange> refused = runtime.reconfigure(wanted);
  ASSERT_FALSE(refused);
  runtime.report_refused_reload(refused.error().message);

  EXPECT_NE(refused.error().message.find("1 is not among swarm.members"), std::string::npos);
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return status["config"].value("fault", "").find("not among") != std::string::npos &&
           status["config"]["generation"] == 2;
  }));
}

TEST_F(Reload, OpensOtherPortsOfMeshSubscriptionAndSensors) {
  const Config first = without_devices(mesh_port_);
  Runtime runtime(first, machine_);
  Config wanted = first;
  wanted.net.interface = "nosuch0";
  wanted.subscription.port = free_port();
  wanted.imu.device.port = "/nowhere/imu";
  wanted.uwb.device.port = "/nowhere/uwb";

  ASSERT_TRUE(runtime.reconfigure(wanted));

  EXPECT_TRUE(Client(wanted).await_status([](const Json& status) {
    return mentions(sensor_of(status, "mesh"), "nosuch0") &&
           mentions(sensor_of(status, "imu"), "/nowhere/imu") &&
           mentions(sensor_of(status, "uwb"), "/nowhere/uwb");
  }));
}

/// Reads what systemd would. A thread of its own, because the socket holds ten messages in some
/// kernels and the daemon waits for whoever does not read.
class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(std::begin(address.sun_path), sizeof(address.sun_path) - 1);
    const void* const raw = &address;
    EXPECT_EQ(::bind(fd_.get(), static_cast<const sockaddr*>(raw), sizeof(address)), 0);
    reader_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) read_for(std::chrono::milliseconds{50});
    });
  }

  /// All that was sent, one message a line, after the last one has come. Reads no more.
  std::string finish() {
    reader_.request_stop();
    reader_.join();
    read_for(std::chrono::milliseconds{0});
    return heard_;
  }

 private:
  void read_for(std::chrono::milliseconds patience) {
    pollfd readable{.fd = fd_.get(), .events = POLLIN, .revents = 0};
    std::array<char, 4096> buffer{};
    while (::poll(&readable, 1, static_cast<int>(patience.count())) > 0) {
      const ssize_t count = ::recv(fd_.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (count <= 0) return;
      heard_.append(buffer.data(), static_cast<std::size_t>(count)).append("\n");
    }
  }

  UniqueFd fd_;
  std::string heard_;
  std::jthread reader_;
};

TEST_F(Reload, HappensOnSighupAndSystemdIsNotified) {
  const ScratchDirectory folder = ScratchDirectory::create({}).value();
  const auto file = folder.path() / "crepesd.yaml";
  Config config = pair_config(1, mesh_port_);
  const auto write = [&](const std::string& more) {
    std::ofstream(file) << write_config(config) << more;
  };
  write("");
  NotifySocket systemd(folder.path() / "notify");
  ::setenv("NOTIFY_SOCKET", (folder.path() / "notify").c_str(),
           1);  // NOLINT(concurrency-mt-unsafe)
  auto daemon =
      ChildProcess::start(crepesd_path(), {"--config", file.string()}, folder.path() / "log");
  ::unsetenv("NOTIFY_SOCKET");  // NOLINT(concurrency-mt-unsafe)
  ASSERT_TRUE(daemon) << daemon.error().message;
  Client client(config);
  const auto has_generation = [&](int generation) {
    return [generation](const Json& status) {
      return status["config"]["generation"] == generation && !status["config"].contains("fault");
    };
  };
  ASSERT_TRUE(client.await_status(has_generation(1)));

  auto second =
      ChildProcess::start(crepesd_path(), {"--config", file.string()}, folder.path() / "second");
  ASSERT_TRUE(second);
  const MonotonicClock clock;
  const Timestamp end = clock.now() + std::chrono::seconds{20};
  while (!second->exit_reason() && clock.now() < end) ::poll(nullptr, 0, 20);
  EXPECT_EQ(second->exit_reason(), "exit code 3");
  EXPECT_NE(read_text_file(folder.path() / "second").value().find("already runs on this machine"),
            std::string::npos);

  config.estimator.output_rate_hz = 20;
  write("");
  daemon->send_signal(SIGHUP);
  EXPECT_TRUE(client.await_status(has_generation(2)));
  write("no such key: 1\n");
  daemon->send_signal(SIGHUP);
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return status["config"].value("fault", "").find("unknown key") != std::string::npos &&
           status["config"]["generation"] == 2;
  }));
  write("");
  daemon->send_signal(SIGHUP);
  EXPECT_TRUE(client.await_status(has_generation(3)));
  config.swarm.members.back().p_body_led.setZero();  // hardly meant
  write("");
  daemon->send_signal(SIGHUP);
  EXPECT_TRUE(client.await_status(has_generation(4)));

  // A pipe in the place of the file neither blocks the daemon nor its end.
  std::filesystem::remove(file);
  ASSERT_EQ(::mkfifo(file.c_str(), 0600), 0);
  daemon->send_signal(SIGHUP);
  EXPECT_TRUE(client.await_status([](const Json& status) {
    return status["config"].value("fault", "").find("is not a file") != std::string::npos;
  }));
  daemon->terminate();
  const Timestamp end_of_first = clock.now() + std::chrono::seconds{20};
  while (!daemon->exit_reason() && clock.now() < end_of_first) ::poll(nullptr, 0, 20);
  EXPECT_EQ(daemon->exit_reason(), "exit code 0");
  EXPECT_NE(read_text_file(folder.path() / "log").value().find("p_body_led: is 0"),
            std::string::npos);

  const std::string heard = systemd.finish();
  EXPECT_NE(heard.find("RELOADING=1\nMONOTONIC_USEC="), std::string::npos) << heard;
  EXPECT_GT(heard.rfind("READY=1"), heard.find("RELOADING=1"));
}

}  // namespace
}  // namespace crepes::reload_test
