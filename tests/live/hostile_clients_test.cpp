/// Programs that mean ill, or were written badly: the poses of the others must not suffer.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/runtime.hpp"
#include "drivers/base/child_process.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "drivers/base/unique_fd.hpp"
#include "estimator/core/quantile.hpp"
#include "tests/support/live_daemon.hpp"
#include "tests/support/places.hpp"

namespace crepes::hostile_clients_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// A hundred thousand requests a second from as many ports as there are sockets, until destruction:
/// 65 kB of nested JSON, garbage, and requests that would be answered at length.
class Flood {
 public:
  static constexpr int kPerSecond = 100'000;

  explicit Flood(int port) : port_(port), thread_([this] { run(); }) {}
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  Flood(Flood&&) = delete;
  Flood& operator=(Flood&&) = delete;
  ~Flood() { stop(); }

  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] long sent() const { return sent_; }
  /// What came back, in bytes; after stop().
  [[nodiscard]] std::size_t answered() const { return answered_; }

 private:
  void run() {
    constexpr int kBatch = kPerSecond / 1000;
    sockaddr_in daemon{};
    daemon.sin_family = AF_INET;
    daemon.sin_port = htons(static_cast<std::uint16_t>(port_));
    daemon.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    std::vector<UniqueFd> sockets;
    for (int i = 0; i < 64; ++i) sockets.emplace_back(::socket(AF_INET, SOCK_DGRAM, 0));
    const std::vector<std::string> requests{R"({"class":"POLL"})", std::string(1200, '['),
                                            "\xff\xfe garbage", R"({"class":"WATCH"})"};
    const std::string huge(65'000, '[');
    const auto send = [&](const std::string& text) {
      const int fd = sockets[static_cast<std::size_t>(sent_) % sockets.size()].get();
      // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): the sockets interface's own
      const auto* to = reinterpret_cast<const sockaddr*>(&daemon);
      if (::sendto(fd, text.data(), text.size(), MSG_DONTWAIT, to, sizeof(daemon)) >= 0) ++sent_;
    };
    const MonotonicClock clock;
    for (Timestamp next = clock.now(); !stop_; next += milliseconds{1}) {
      send(huge);
      for (int i = 1; i < kBatch; ++i) send(requests[static_cast<std::size_t>(i) % 4]);
      drain(sockets);
      const Duration rest = next + milliseconds{1} - clock.now();
      if (rest > Duration::zero()) std::this_thread::sleep_for(rest);
      if (rest < -milliseconds{100}) next = clock.now();  // a laden machine: as many as it can
    }
    drain(sockets);
  }

  void drain(const std::vector<UniqueFd>& sockets) {
    std::array<char, 2048> bytes{};
    for (const UniqueFd& fd : sockets) {
      for (ssize_t size = 0;
           (size = ::recv(fd.get(), bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;)
        answered_ += static_cast<std::size_t>(size);
    }
  }

  int port_;
  std::atomic<bool> stop_{false};
  std::atomic<long> sent_{0};
  std::size_t answered_ = 0;
  std::thread thread_;
};

/// How a good client fares: the delay of each pose from the estimator to the client.
struct Service {
  std::vector<double> delays_s;
  long lost = 0;  ///< gaps in `seq`

  [[nodiscard]] double quantile(double share) {
    return delays_s.empty() ? 1e9 : crepes::quantile(delays_s, share);
  }
};

/// A program that asked before the others came.
class GoodClient {
 public:
  explicit GoodClient(const Config& config)
      : daemon_(
            Endpoint::ipv4({127, 0, 0, 1}, static_cast<std::uint16_t>(config.subscription.port))),
        clock_(machine_, config.sim) {}

  /// Until then, or until it has `enough` poses.
  Service served_for(Duration time, std::size_t enough = std::numeric_limits<std::size_t>::max()) {
    Service service;
    Timestamp renewal = machine_.now();
    const Timestamp end = renewal + time;
    while (machine_.now() < end && service.delays_s.size() < enough) {
      if (machine_.now() >= renewal) {
        const std::string watch = R"({"class":"WATCH"})";
        (void)socket_.send_to(std::vector<std::uint8_t>(watch.begin(), watch.end()), daemon_);
        renewal = machine_.now() + milliseconds{500};
      }
      const auto datagram = socket_.receive(milliseconds{50});
      if (datagram && *datagram) take((*datagram)->bytes, service);
    }
    return service;
  }

 private:
  void take(const std::vector<std::uint8_t>& bytes, Service& service) {
    const Timestamp arrival = clock_.now();
    const Json json = Json::parse(bytes);
    if (json["class"] != "POSE") return;
    const Timestamp published{Duration{std::stoll(json["t_pub_ns"].get<std::string>())}};
    service.delays_s.push_back(to_seconds(arrival - published));
    const long sequence = json["seq"].get<long>();
    if (next_sequence_ >= 0) service.lost += sequence - next_sequence_;
    next_sequence_ = sequence + 1;
  }

  MonotonicClock machine_;
  UdpSocket socket_ = UdpSocket::bind("127.0.0.1", 0).value();
  Endpoint daemon_;
  SimClock clock_;
  long next_sequence_ = -1;
};

class HostileClients : public LiveDaemon {
 protected:
  Config first_ = pair_config(1, mesh_port_);
  Runtime one_{first_, machine_};
  Runtime two_{pair_config(2, mesh_port_), machine_};
};

TEST_F(HostileClients, DoNotDelayThePosesOfOthersByAHundredThousandRequestsASecond) {
  if (kIsSanitized) GTEST_SKIP() << "instrumented, robots and a flood are too much for two cores";
  constexpr Duration kTime = seconds{4};
  expect_true_poses(first_);
  GoodClient client(first_);
  Service calm = client.served_for(kTime);
  const Timestamp start = machine_.now();

  Flood flood(first_.subscription.port);
  Service stormy = client.served_for(kTime);
  flood.stop();

  const double elapsed_s = to_seconds(machine_.now() - start);
  std::printf(
      "calm: %zu poses, delay p50 %.1f ms, p99 %.1f ms; in a flood of %.0f requests/s: %zu "
      "poses, %ld lost, p50 %.1f ms, p99 %.1f ms; answered %zu bytes\n",
      calm.delays_s.size(), 1e3 * calm.quantile(0.5), 1e3 * calm.quantile(0.99),
      static_cast<double>(flood.sent()) / elapsed_s, stormy.delays_s.size(), stormy.lost,
      1e3 * stormy.quantile(0.5), 1e3 * stormy.quantile(0.99), flood.answered());
  EXPECT_GT(flood.sent(), 10'000);
  EXPECT_EQ(stormy.lost, 0);
  // A machine that runs other tests beside these makes even calm poses late: some of the
  // scheduler's slices, for a flood that takes much of a core.
  EXPECT_LT(stormy.quantile(0.99), calm.quantile(0.99) + 0.05);
  EXPECT_GT(stormy.delays_s.size(), calm.delays_s.size() / 2);
  // 200 at once and 500 a second are read, of all who have no subscription; four of them may have
  // one, with 50 poses and 50 answers a second each.
  EXPECT_LT(static_cast<double>(flood.answered()), 1200.0 * (400 + (500 + 4 * 100) * elapsed_s));
}

TEST_F(HostileClients, KeepNoPoliteProgramOfTheirAddressFromItsPoses) {
  if (kIsSanitized) GTEST_SKIP() << "instrumented, robots and a flood are too much for two cores";
  Flood flood(first_.subscription.port);
  // All places of the address are taken, by programs that renew their leases again and again.
  EXPECT_TRUE(Client(first_).await(
      R"({"class":"POLL","about":"network"})", "STATUS", [](const Json& status) {
        return status["network"].value("subscribers", 0) == SubscriptionConfig{}.max_per_address;
      }));

  const Timestamp begin = machine_.now();
  Client newcomer(first_);
  EXPECT_TRUE(newcomer.await(R"({"class":"WATCH"})", "POSE", [](const Json&) { return true; }));
  std::printf("a newcomer's first pose after %.2f s\n", to_seconds(machine_.now() - begin));

  // Its place is its own, as long as it keeps the lease. A port whose buckets the flood's ports
  // share may never be heard: then another.
  std::optional<GoodClient> client;
  int ports = 0;
  do {
    client.emplace(first_);
  } while (client->served_for(seconds{3}, 1).delays_s.empty() && ++ports < 4);
  constexpr std::size_t kMany = 100;
  const Service stormy = client->served_for(seconds{30}, kMany);
  EXPECT_EQ(stormy.delays_s.size(), kMany);
  EXPECT_EQ(stormy.lost, 0);
}

TEST_F(HostileClients, AreCounted) {
  Flood flood(first_.subscription.port);

  EXPECT_TRUE(Client(first_).await(R"({"class":"POLL","about":"network"})", "STATUS",
                                   [](const Json& status) {
                                     const Json& network = status["network"];
                                     return network.value("requests_in_excess", 0) > 1000 &&
                                            network.value("requests_refused", 0) > 0;
                                   }));
}

// In a network of their own: forged senders, port 0, broadcast and multicast senders, the daemon's
// own address. Counted on the wire.
TEST_F(HostileClients, GetNothingAmplifiedWhoeverTheyPretendToBe) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto log = scratch.path() / "log";
  auto child = ChildProcess::start(
      "/usr/bin/env",
      {"unshare", "-rn", "/usr/bin/python3", "-B", source_dir() + "/tests/live/forged_requests.py",
       crepesd_path(), source_dir() + "/config/examples"},
      log);
  ASSERT_TRUE(child) << child.error().message;
  const Timestamp end = machine_.now() + kPatience;
  while (!child->exit_reason() && machine_.now() < end) ::poll(nullptr, 0, 50);

  const std::string reported = read_text_file(log).value_or("");
  std::printf("%s", reported.c_str());
  if (child->exit_reason() == "exit code 77") GTEST_SKIP() << reported;
  EXPECT_EQ(child->exit_reason(), "exit code 0");
}

}  // namespace
}  // namespace crepes::hostile_clients_test
