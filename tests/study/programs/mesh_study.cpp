/// mesh_study: what swarms take of the air, and what of their measurements arrives. Only the mesh
/// runs: inertial samples, bearings and ranges are made up, as many as robots in sight of all
/// others have, as smooth and as noisy as those of the recordings.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "net/mesh/peer_link.hpp"

namespace crepes::study {
namespace {

struct Options {
  std::vector<std::size_t> robots{5, 20, 50};
  std::vector<double> rates_mbps{6, 24};
  int repeats = 3;
  double airtime_of_all = 0.5;
  bool unlimited = false;
  double loss = 0.02;
  double duration_s = 10.0;
  std::uint32_t seed = 1;
};

constexpr double kReportPeriod = 0.04;  // s
constexpr double kHistory = 0.52;       // s, of a report
constexpr double kImuRate = 100.0;      // Hz
constexpr double kRangeRate = 10.5;     // Hz, of a pair
constexpr double kGyroSigma = 0.0064;   // rad/s, of a sample
constexpr double kAccelSigma = 0.2;     // m/s^2
constexpr double kScoredFrom = 3.0;     // s: then every clock should be known

Timestamp stamp_at(double t) { return Timestamp{from_seconds(t)}; }

/// What is made up of one robot. Each draws from its own stream.
class MadeUpRobot {
 public:
  MadeUpRobot(std::size_t index, const std::vector<RobotId>& members, std::uint32_t seed)
      : index_(index), members_(members), random_(seed * 1000 + static_cast<unsigned>(index)) {}

  /// Advances to `t` and reports what there is of the last half second.
  [[nodiscard]] Report report(double t) {
    for (; next_imu_ <= t; next_imu_ += 1 / kImuRate) add_sample(next_imu_);
    for (std::size_t n = 0; n < members_.size(); ++n) {
      if (n == index_) continue;
      history_.bearings.push_back({stamp_at(t - 0.004), members_[n], direction(n, t - 0.004),
                                   Eigen::Vector3d(0.05, 0, 0.02), 7e-4});
      if (uniform() < kRangeRate * kReportPeriod) add_range(n, t - kReportPeriod * uniform());
    }
    const auto is_old = [&](const auto& item) { return item.stamp < stamp_at(t - kHistory); };
    std::erase_if(history_.imu, is_old);
    std::erase_if(history_.bearings, is_old);
    std::erase_if(history_.ranges, is_old);
    history_.sender = members_[index_];
    history_.stamp = stamp_at(t);
    history_.tilt = {stamp_at(t), Eigen::Vector3d(0.05, 0, 1).normalized(), 0.01};
    add_estimates(t);
    return history_;
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  Eigen::Vector3d noise(double sigma) {
    std::normal_distribution<double> normal(0, sigma);
    return {normal(random_), normal(random_), normal(random_)};
  }

  void add_sample(double t) {
    history_.imu.push_back(
        {stamp_at(t),
         Eigen::Vector3d(0.4 * std::sin(2 * t), 0.3 * std::cos(3 * t), 0.2) + noise(kGyroSigma),
         Eigen::Vector3d(std::sin(2 * t), std::cos(t), 9.81) + noise(kAccelSigma)});
  }

  Eigen::Vector3d direction(std::size_t n, double t) {
    const double azimuth = static_cast<double>(7 * n + index_) + 0.5 * std::sin(t);
    return (Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.1 * std::sin(2 * t)) +
            noise(7e-4))
        .normalized();
  }

  void add_range(std::size_t n, double t) {
    const double range_m = 3.0 + static_cast<double>(n % 10) + std::sin(t) + noise(0.05).x();
    history_.ranges.push_back({stamp_at(t), members_[n], range_m, -81 + noise(1).x(), -80});
  }

  void add_estimates(double t) {
    history_.estimates.clear();
    for (std::size_t n = 0; n < members_.size(); ++n) {
      if (n == index_) continue;
      NeighborEstimate estimate{
          stamp_at(t), members_[n], {{}, Matrix6d::Identity() * 1e-4}, Eigen::Vector3d::Zero()};
      estimate.T_B_N.pose.p = 5.0 * direction(n, t);
      history_.estimates.push_back(estimate);
    }
  }

  std::size_t index_;
  std::vector<RobotId> members_;
  std::mt19937 random_;
  double next_imu_ = 0.0;
  Report history_;
};

/// What arrived from second kScoredFrom on, over all ordered pairs.
struct Arrived {
  std::uint64_t samples = 0;
  std::uint64_t bearings = 0;
  std::uint64_t ranges = 0;
  std::vector<double> sample_ages_s;  ///< of the oldest new sample, at each arrival of a report
  double last_clock_s = 0.0;          ///< when the last pair knew each other's clock
};

class MadeUpSwarm {
 public:
  MadeUpSwarm(std::size_t robots, const SendSettings& settings, const Options& options)
      : options_(options), settings_(settings), random_(options.seed) {
    std::vector<RobotId> members;
    for (std::size_t i = 1; i <= robots; ++i) members.emplace_back(static_cast<std::uint16_t>(i));
    for (std::size_t i = 0; i < robots; ++i) {
      robots_.emplace_back(i, members, options.seed);
      links_.emplace_back(members[i], members, settings);
      phases_.push_back(kReportPeriod * uniform());
      known_from_.push_back(std::vector<double>(robots + 1, -1.0));
    }
  }

  void run() {
    for (int step = 0; kReportPeriod * step < options_.duration_s; ++step) {
      std::vector<std::pair<double, std::size_t>> turns;
      for (std::size_t i = 0; i < links_.size(); ++i)
        turns.emplace_back(kReportPeriod * step + phases_[i], i);
      std::ranges::sort(turns);
      for (const auto& [t, i] : turns) {
        deliver_until(t);
        send(i, t);
      }
    }
  }

  [[nodiscard]] const Arrived& arrived() const { return arrived_; }
  [[nodiscard]] double datagrams_per_s() const { return per_robot(sent_); }
  [[nodiscard]] double bytes_per_datagram() const {
    return static_cast<double>(bytes_) / static_cast<double>(sent_);
  }
  /// Of each robot and scored second.
  [[nodiscard]] double per_robot(std::uint64_t count) const {
    return static_cast<double>(count) / (options_.duration_s - kScoredFrom) /
           static_cast<double>(links_.size());
  }
  [[nodiscard]] double per_pair(std::uint64_t count) const {
    return per_robot(count) / static_cast<double>(links_.size() - 1);
  }
  [[nodiscard]] const SendSettings& settings() const { return settings_; }

 private:
  struct Packet {
    double arrives_s;
    std::size_t to;
    std::vector<std::uint8_t> bytes;
    bool operator<(const Packet& other) const { return arrives_s > other.arrives_s; }
  };

  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  void send(std::size_t i, double t) {
    const Report report = robots_[i].report(t);
    if (!links_[i].is_due(stamp_at(t))) return;
    const auto bytes = links_[i].compose(report, stamp_at(t), seal_, signer_);
    if (t >= kScoredFrom) {
      ++sent_;
      bytes_ += bytes.size();
    }
    for (std::size_t to = 0; to < links_.size(); ++to) {
      if (to != i && uniform() >= options_.loss)
        wire_.push({t + 0.003 + 0.003 * uniform(), to, bytes});
    }
  }

  void deliver_until(double t) {
    for (; !wire_.empty() && wire_.top().arrives_s <= t; wire_.pop()) {
      const Packet& packet = wire_.top();
      const Timestamp arrival = stamp_at(packet.arrives_s);
      const auto received = links_[packet.to].receive(packet.bytes, arrival, seal_);
      if (received) count(packet, received->report);
    }
  }

  void count(const Packet& packet, const Report& report) {
    double& known_from = known_from_[packet.to][report.sender.value];
    if (known_from < 0) {
      known_from = packet.arrives_s;
      arrived_.last_clock_s = std::max(arrived_.last_clock_s, known_from);
    }
    if (packet.arrives_s < kScoredFrom) return;
    arrived_.samples += report.imu.size();
    arrived_.bearings += report.bearings.size();
    arrived_.ranges += report.ranges.size();
    if (!report.imu.empty())
      arrived_.sample_ages_s.push_back(
          to_seconds(stamp_at(packet.arrives_s) - report.imu.front().stamp));
  }

  const Options& options_;
  SendSettings settings_;
  std::mt19937 random_;
  std::vector<MadeUpRobot> robots_;
  std::vector<PeerLink> links_;
  std::vector<double> phases_;
  std::vector<std::vector<double>> known_from_;  ///< [s], by receiver and sender; -1: never
  std::priority_queue<Packet> wire_;
  std::optional<PacketSeal> seal_{MeshKey{{7}}};
  std::optional<PacketSigner> signer_{robot_key_of(std::array<std::uint8_t, 32>{1})};
  Arrived arrived_;
  std::uint64_t sent_ = 0;
  std::uint64_t bytes_ = 0;
};

void print_swarm(std::size_t robots, double rate_mbps, const Options& options) {
  const Broadcasts air{.rate_mbps = rate_mbps, .repeats = options.repeats};
  SendSettings settings{.airtime_of_all = options.airtime_of_all,
                        .broadcasts = air,
                        .gyro_step_radps = kGyroSigma / 2,
                        .accel_step_mps2 = kAccelSigma / 2};
  if (options.unlimited) settings.broadcasts = {.rate_mbps = 1000, .repeats = 1};
  MadeUpSwarm swarm(robots, settings, options);
  swarm.run();
  const double of_one = airtime(swarm.datagrams_per_s(), swarm.bytes_per_datagram(), air);
  std::vector<double> ages = swarm.arrived().sample_ages_s;
  std::ranges::sort(ages);
  const double worst_age = ages.empty() ? NAN : ages[ages.size() * 99 / 100];
  std::printf("%6zu %6.0f %8.1f %8.0f %8.1f %8.2f %8.1f %8.1f %8.1f %8.1f %8.0f %8.1f\n", robots,
              rate_mbps, swarm.datagrams_per_s(), swarm.bytes_per_datagram(),
              1e-3 * swarm.datagrams_per_s() * swarm.bytes_per_datagram(), 100 * of_one,
              100 * of_one * static_cast<double>(robots), swarm.per_pair(swarm.arrived().samples),
              swarm.per_pair(swarm.arrived().bearings) / static_cast<double>(robots - 1),
              swarm.per_pair(swarm.arrived().ranges) / static_cast<double>(robots - 1),
              1e3 * worst_age, swarm.arrived().last_clock_s);
  std::fflush(stdout);
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  using namespace crepes::study;
  Options options;
  CLI::App app("What swarms take of the air, and what arrives");
  app.add_option("--robots", options.robots, "sizes of swarms")->check(CLI::Range(2, 200));
  app.add_option("--mbps", options.rates_mbps, "rates of broadcasts")->check(CLI::Range(1, 54));
  app.add_option("--repeats", options.repeats, "net.broadcast_repeats")->check(CLI::Range(1, 300));
  app.add_option("--airtime", options.airtime_of_all, "net.airtime_of_all");
  app.add_flag("--unlimited", options.unlimited, "as if there were air enough");
  app.add_option("--loss", options.loss, "share of lost datagrams")->check(CLI::Range(0.0, 0.9));
  app.add_option("--seconds", options.duration_s, "from second 3 on is scored");
  app.add_option("--seed", options.seed, "of noise, loss and phases");
  CLI11_PARSE(app, argc, argv);
  std::printf("%6s %6s %8s %8s %8s %8s %8s %8s %8s %8s %8s %8s\n", "robots", "Mbit/s", "dgrams/s",
              "bytes", "kB/s", "air %", "all %", "imu/s", "bear/s", "range/s", "age ms",
              "clocks s");
  for (const double rate_mbps : options.rates_mbps)
    for (const std::size_t robots : options.robots) print_swarm(robots, rate_mbps, options);
  return 0;
}
