/// Daemons of a sealed and signed swarm that are killed, stopped, cloned and flooded, in real time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "config/schema/mesh_slice.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "net/mesh/peer_link.hpp"
#include "tests/support/datagram_flood.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::live_faults_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// What runs beside the robots until it is destroyed.
class Beside {
 public:
  explicit Beside(std::function<void()> again)
      : thread_([this, again = std::move(again)] {
          while (!stop_) again();
        }) {}
  Beside(const Beside&) = delete;
  Beside(Beside&&) = delete;
  Beside& operator=(const Beside&) = delete;
  Beside& operator=(Beside&&) = delete;
  ~Beside() {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// The poses that a client of the first robot gets of the second.
struct Watched {
  std::size_t poses = 0;
  double worst_m = 0.0;
  bool is_direct = false;  ///< the last one
};

class SealedSwarm : public LiveDaemon {
 protected:
  SealedSwarm() {
    swarm_key_ = write_mesh_key(scratch_.path() / "swarm.key").value();
    for (std::uint16_t id : {1, 2})
      robot_keys_[id] = write_robot_key(scratch_.path() / key_name(id)).value();
    for (std::uint16_t id : {1, 2}) start(id);
  }

  static std::string key_name(std::uint16_t id) { return "r" + std::to_string(id) + ".key"; }

  void start(std::uint16_t id) {
    robots_.erase(id);
    auto [config, is_new] = configs_.try_emplace(id, pair_config(id, mesh_port_));
    Config& own = config->second;
    own.net.key_file = (scratch_.path() / "swarm.key").string();
    own.net.robot_key_file = (scratch_.path() / key_name(id)).string();
    own.recording.socket.clear();
    for (MemberConfig& member : own.swarm.members)
      member.public_key = to_text(public_key_of(robot_keys_.at(member.id.value)));
    const auto file = scratch_.path() / ("r" + std::to_string(id) + ".yaml");
    std::ofstream(file) << write_config(own);
    auto process = ChildProcess::start(crepesd_path(), {"--config", file.string()},
                                       scratch_.path() / ("log" + std::to_string(id)));
    ASSERT_TRUE(process) << process.error().message;
    robots_.emplace(id, std::move(*process));
  }

  /// Until there are poses of the second robot as they should be.
  void await_poses() {
    const Timestamp end = machine_.now() + kPatience;
    Watched now;
    while (!(now.is_direct && now.worst_m < 0.5) && machine_.now() < end)
      now = watch(milliseconds{200});
    EXPECT_TRUE(now.is_direct) << "no poses";
  }

  Watched watch(Duration time) {
    Watched watched;
    if (!client_) client_.emplace(configs_.at(1));
    const Timestamp end = machine_.now() + time;
    while (machine_.now() < end) {
      if (machine_.now() > renewal_) {
        client_->send(R"({"class":"WATCH"})");
        renewal_ = machine_.now() + seconds{1};
      }
      const auto pose = client_->next(milliseconds{50});
      if (!pose || (*pose)["class"] != "POSE") continue;
      ++watched.poses;
      watched.worst_m = std::max(watched.worst_m, error_of(*pose, configs_.at(1)).position_m);
      watched.is_direct = (*pose)["mode"] == "direct";
    }
    return watched;
  }

  /// No pose is further off than 0.1 m more than without faults, and in the end all is as before.
  void expect_unmoved(const char* fault, const Watched& during) {
    await_poses();
    const Watched after = watch(seconds{2});
    std::printf("%s: %zu poses, at most %.3f m off; then %zu, %.3f m; without faults %.3f m\n",
                fault, during.poses, during.worst_m, after.poses, after.worst_m, calm_.worst_m);
    EXPECT_GT(during.poses, 0U) << fault;
    EXPECT_LT(during.worst_m, calm_.worst_m + 0.1) << fault;
    EXPECT_LT(after.worst_m, calm_.worst_m + 0.1) << fault;
    EXPECT_TRUE(after.is_direct) << fault;
  }

  /// A robot with r2's id and all of its keys, which stands elsewhere.
  std::function<void()> clone_of_second() {
    SendSettings settings = send_settings(configs_.at(2));
    settings.session_salt = random_salt();
    auto link =
        std::make_shared<PeerLink>(RobotId{2}, std::vector{RobotId{1}, RobotId{2}}, settings);
    auto socket = std::make_shared<UdpSocket>(
        UdpSocket::open_broadcast("lo", static_cast<std::uint16_t>(mesh_port_)).value());
    const std::optional<PacketSeal> seal{PacketSeal(swarm_key_)};
    const std::optional<PacketSigner> signer{PacketSigner(robot_keys_.at(2))};
    return [this, link, socket, seal, signer] {
      for (int i = 0; i < 20; ++i) {
        const auto heard = socket->receive(milliseconds{2});
        if (heard && *heard)
          (void)link->receive((*heard)->bytes, machine_.now(), seal, (*heard)->from);
      }
      const Timestamp now = machine_.now();
      Report lie;
      lie.sender = RobotId{2};
      lie.stamp = now;
      lie.tilt = {now, Eigen::Vector3d::UnitX(), 0.001};
      lie.imu = {{now, {1.0, 2.0, 3.0}, {9.81, 0.0, 0.0}}};
      lie.ranges = {{now, RobotId{1}, 20.0, -80.0, -80.0}};
      (void)socket->broadcast(link->compose(lie, now, seal, signer));
    };
  }

  /// A datagram that is on the air.
  [[nodiscard]] std::vector<std::uint8_t> overheard() const {
    auto socket = UdpSocket::open_broadcast("lo", static_cast<std::uint16_t>(mesh_port_)).value();
    const Timestamp end = machine_.now() + kPatience;
    while (machine_.now() < end) {
      const auto datagram = socket.receive(milliseconds{50});
      if (datagram && *datagram) return (*datagram)->bytes;
    }
    return {};
  }

  /// A hundred thousand damaged datagrams a second, while the machine does other work too.
  void expect_unmoved_by_flood(bool from_member) {
    const auto port = static_cast<std::uint16_t>(mesh_port_);
    const std::vector<std::uint8_t> sample = overheard();
    ASSERT_FALSE(sample.empty());
    DatagramFlood flood(port, from_member, sample);
    ASSERT_TRUE(flood.is_open());
    const long before = DatagramFlood::dropped(port);
    Watched flooded;
    const Timestamp start = machine_.now();
    {
      const Beside sender([&] { flood.send_due(); });
      const Beside work([] {});
      flooded = watch(seconds{3});
    }
    const double seconds_long = to_seconds(machine_.now() - start);
    std::printf("%.0f forged datagrams a second for %.1f s, %ld dropped by the kernel of %ld; ",
                static_cast<double>(flood.sent()) / seconds_long, seconds_long,
                DatagramFlood::dropped(port) - before, 2 * flood.sent());
    EXPECT_GT(flood.sent(), 10'000);
    expect_unmoved(from_member ? "a flood from a member's address" : "a flood from a stranger's",
                   flooded);
  }

  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
  MeshKey swarm_key_;
  std::map<std::uint16_t, RobotKey> robot_keys_;
  std::map<std::uint16_t, Config> configs_;
  std::map<std::uint16_t, ChildProcess> robots_;
  std::optional<Client> client_;  // one: an address has four places
  Timestamp renewal_{};
  Watched calm_;
};

TEST_F(SealedSwarm, KeepsItsPosesWhateverHappensToAMember) {
  if (kIsSanitized) GTEST_SKIP() << "instrumented, robots and floods are too much for two cores";
  await_poses();
  calm_ = watch(seconds{4});

  robots_.at(2).send_signal(SIGKILL);
  const Watched killed = watch(seconds{2});
  start(2);
  expect_unmoved("kill -9 and a restart", killed);

  robots_.at(2).send_signal(SIGSTOP);
  Watched stopped = watch(seconds{3});
  robots_.at(2).send_signal(SIGCONT);
  const Watched thawed = watch(seconds{1});
  stopped.worst_m = std::max(stopped.worst_m, thawed.worst_m);
  expect_unmoved("SIGSTOP for 3 s", stopped);

  {
    const Beside clone(clone_of_second());
    const Watched doubled = watch(seconds{3});
    EXPECT_TRUE(Client(configs_.at(1)).await_status([](const Json& status) {
      return mentions(sensor_of(status, "mesh"), "id 2");
    }));
    EXPECT_GT(doubled.poses, 0U);
    expect_unmoved("a clone of r2", doubled);
  }
  expect_unmoved_by_flood(false);
  expect_unmoved_by_flood(true);
}

}  // namespace
}  // namespace crepes::live_faults_test
