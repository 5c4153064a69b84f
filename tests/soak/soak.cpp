#include "tests/soak/soak.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>
#include <sstream>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/runtime.hpp"
#include "daemon/service/logging.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/uwb/nlink_encoder.hpp"
#include "drivers/uwb/nlink_frame.hpp"
#include "estimator/core/contract.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/udp_socket.hpp"
#include "tests/soak/soak_camera.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

constexpr double kGyroStep = 0.05;  // rad/s

/// The six numbers of sample `number` determine each other: any two samples mixed, or a bit
/// changed, shows. From one sample to the next they change as little as a robot's motion does.
ImuSample sample_of(std::uint32_t number) {
  const unsigned x = number % 16;
  const unsigned y = number / 16 % 16;
  const unsigned z = (x + 3 * y + 5) % 16;
  return {.gyro_radps = Eigen::Vector3d(x, y, z) * kGyroStep,
          .accel_mps2 = Eigen::Vector3d(x, y, z + 60.0) * 0.15};
}

bool was_sent(const Eigen::Vector3d& gyro_radps, const Eigen::Vector3d& accel_mps2) {
  const auto level = [&](Eigen::Index i) {
    return static_cast<std::uint32_t>(std::lround(std::max(gyro_radps[i], 0.0) / kGyroStep));
  };
  const ImuSample sent = sample_of(level(0) + 16 * level(1));
  return (gyro_radps - sent.gyro_radps).norm() < 5e-3 &&
         (accel_mps2 - sent.accel_mps2).norm() < 2e-2;
}

NlinkNode range_of(std::uint32_t number, std::uint32_t module) {
  const std::uint32_t step = number % 50;
  const std::uint32_t mm = 1000 + 100 * step + 10 * module + (step + module) % 10;
  const double first_path = -80.0 - step % 8;
  return {.module = module,
          .range_m = mm / 1000.0,
          .first_path_dbm = first_path,
          .received_dbm = first_path + 2.0};
}

bool was_sent(const BasicUwbRange<PeerTimestamp>& range) {
  const auto step = static_cast<std::uint32_t>(std::floor(range.range_m * 10.0)) - 10;
  const NlinkNode sent = range_of(step, range.neighbor.value);
  return std::abs(range.range_m - sent.range_m) < 4e-4 &&
         range.first_path_dbm == sent.first_path_dbm && range.received_dbm == sent.received_dbm;
}

std::size_t open_descriptors() {
  return static_cast<std::size_t>(
      std::distance(fs::directory_iterator("/proc/self/fd"), fs::directory_iterator()));
}

std::size_t resident_kb() {
  std::size_t size = 0;
  std::size_t resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE)) / 1024;
}

int free_port() {
  const Result<UdpSocket> probe = UdpSocket::bind("127.0.0.1", 0);
  CREPES_EXPECT(probe.has_value(), "loopback");
  return probe->local().port;
}

class Soak {
 public:
  explicit Soak(const SoakPlan& plan)
      : plan_(plan),
        scratch_(*ScratchDirectory::create("")),
        camera_(scratch_.path() / "cam0", plan.seed + 2),
        imu_(scratch_.path() / "imu", {100.0, 50.0, 200.0}, &imu_frame, plan.seed, clock_.now()),
        uwb_(scratch_.path() / "uwb", {50.0, 10.0, 100.0}, &uwb_frame, plan.seed + 1, clock_.now()),
        config_(make_config()),
        mesh_(*UdpSocket::open_broadcast("lo", static_cast<std::uint16_t>(config_.net.port))),
        daemon_(*connect({.port = static_cast<std::uint16_t>(config_.subscription.port)},
                         {.watch = false, .polls = {{.period_s = 0.1}}})) {}

  SoakReport run() {
    const LogSession log(LogLevel::kError);
    std::optional<Runtime> runtime;
    runtime.emplace(config_, clock_);
    stir(false);
    run_until(is_well_);
    report_ = {};
    report_.camera_is_gige = camera_.is_gige();
    report_.descriptors_before = open_descriptors();
    stir(true);
    const Timestamp begin = clock_.now();
    run_until([&] { return clock_.now() - begin >= plan_.warm_up; });
    report_.memory_before_kb = resident_kb();
    run_until([&] { return clock_.now() - begin >= plan_.duration; });
    stir(false);
    run_until(is_well_);
    report_.memory_after_kb = resident_kb();
    report_.descriptors_after = open_descriptors();
    return report_;
  }

 private:
  void stir(bool stirred) {
    imu_.stir(stirred);
    uwb_.stir(stirred);
    camera_.stir(stirred);
  }

  static std::vector<std::uint8_t> imu_frame(std::uint32_t number, std::uint32_t /*time_ms*/) {
    const ImuSample sample = sample_of(number);
    const auto bytes = encode_witmotion(sample.gyro_radps, sample.accel_mps2);
    return {bytes.begin(), bytes.end()};
  }
  static std::vector<std::uint8_t> uwb_frame(std::uint32_t number, std::uint32_t time_ms) {
    return encode_node_frame3(1, time_ms, {range_of(number, 2), range_of(number, 3)});
  }

  [[nodiscard]] Config make_config() const {
    Config config;
    config.robot.id = RobotId{1};
    config.swarm.members.resize(3);
    for (std::size_t i = 0; i < 3; ++i) {
      MemberConfig& member = config.swarm.members[i];
      member.id = RobotId{static_cast<std::uint16_t>(i + 1)};
      member.name = "r" + std::to_string(i + 1);
      member.duty = 0.2 + 0.2 * static_cast<double>(i);
    }
    config.cameras = {camera_.config()};
    config.imu.device.port = scratch_.path() / "imu";
    config.uwb.device.port = scratch_.path() / "uwb";
    config.net.interface = "lo";
    config.net.port = free_port();
    config.subscription.port = free_port();
    return config;
  }

  template <class Done>
  void run_until(Done done) {
    while (!done() && report_.stuck.empty()) {
      const Timestamp now = clock_.now();
      imu_.step(now);
      uwb_.step(now);
      camera_.step(now);
      listen();
      ask(now);
      judge(now);
    }
  }

  void listen() {
    for (milliseconds patience{2};; patience = milliseconds{0}) {
      const auto datagram = mesh_.receive(patience);
      if (!datagram || !*datagram) return;
      const auto message = decode_peer_message((*datagram)->bytes);
      if (message && message->report.sender == RobotId{1}) examine(message->report);
    }
  }

  void examine(const BasicReport<PeerTimestamp>& report) {
    const Timestamp now = clock_.now();
    const Timestamp samples_known_to = last_sample_;
    const Timestamp ranges_known_to = last_range_;
    for (const auto& sample : report.imu) {
      const Timestamp stamp{sample.stamp.time_since_epoch()};
      if (!was_sent(sample.gyro_radps, sample.accel_mps2)) {
        std::ostringstream text;
        text << "gyro " << sample.gyro_radps.transpose() << " accel "
             << sample.accel_mps2.transpose();
        report_.wrong = text.str();
      }
      if (stamp > samples_known_to) ++report_.samples;
      last_sample_ = std::max(last_sample_, stamp);
      note(imu_.heard(stamp, now));
    }
    for (const auto& range : report.ranges) {
      const Timestamp stamp{range.stamp.time_since_epoch()};
      if (!was_sent(range)) report_.wrong = "range " + std::to_string(range.range_m);
      if (stamp > ranges_known_to) ++report_.ranges;
      last_range_ = std::max(last_range_, stamp);
      note(uwb_.heard(stamp, now, imu_.well_since()));  // reports need an inertial sensor
    }
  }

  void note(const std::optional<Recovery>& recovery) {
    if (!recovery) return;
    SoakReport::PerMishap& per = report_.mishaps[static_cast<std::size_t>(recovery->mishap)];
    ++per.count;
    per.longest = std::max(per.longest, recovery->took);
  }

  /// How the camera is, ten times a second.
  void ask(Timestamp now) {
    while (const auto answer = daemon_.receive(milliseconds{0})) {
      const auto* status = std::get_if<client::Status>(&answer->message);
      if (status == nullptr) continue;
      for (const client::Status::Sensor& sensor : status->sensors) {
        if (sensor.name != "cam0" || !sensor.ok || sensor.rate_hz < 10.0) continue;
        const auto took = camera_.heard(now);
        if (!took) continue;
        ++report_.pictures_returned;
        report_.longest_camera = std::max(report_.longest_camera, *took);
      }
    }
  }

  void judge(Timestamp now) {
    const auto late = [&](const std::optional<Duration>& waiting) {
      return waiting && *waiting > plan_.give_up;
    };
    if (late(imu_.waiting(now)))
      report_.stuck =
          "imu after " + std::string(kMishapNames[static_cast<std::size_t>(imu_.last_mishap())]);
    if (late(uwb_.waiting(now)))
      report_.stuck =
          "uwb after " + std::string(kMishapNames[static_cast<std::size_t>(uwb_.last_mishap())]);
    if (late(camera_.waiting(now))) report_.stuck = "camera";
  }

  SoakPlan plan_;
  MonotonicClock clock_;
  ScratchDirectory scratch_;
  SoakCamera camera_;
  SoakDevice imu_;
  SoakDevice uwb_;
  Config config_;
  UdpSocket mesh_;
  client::Connection daemon_;
  SoakReport report_;
  Timestamp last_sample_{};
  Timestamp last_range_{};
  std::function<bool()> is_well_ = [this] {
    return imu_.is_well() && uwb_.is_well() && camera_.is_well();
  };
};

}  // namespace

Duration SoakReport::longest() const {
  Duration most = longest_camera;
  for (const PerMishap& per : mishaps) most = std::max(most, per.longest);
  return most;
}

SoakReport run_soak(const SoakPlan& plan) { return Soak(plan).run(); }

std::string to_string(const SoakReport& report) {
  std::ostringstream out;
  out.setf(std::ios::fixed);
  out.precision(3);
  for (std::size_t i = 1; i < kMishapNames.size(); ++i) {
    out << kMishapNames[i] << ": " << report.mishaps[i].count << ", recovered within "
        << to_seconds(report.mishaps[i].longest) << " s\n";
  }
  out << (report.camera_is_gige ? "GigE camera" : "folder")
      << " unplugged: " << report.pictures_returned << ", reported to work again within "
      << to_seconds(report.longest_camera) << " s\n"
      << report.samples << " samples, " << report.ranges
      << " ranges; wrong: " << (report.wrong.empty() ? "none" : report.wrong) << '\n'
      << "descriptors " << report.descriptors_before << " -> " << report.descriptors_after
      << ", resident " << report.memory_before_kb << " -> " << report.memory_after_kb << " kB\n";
  if (!report.stuck.empty()) out << "did not recover: " << report.stuck << '\n';
  return out.str();
}

}  // namespace crepes
