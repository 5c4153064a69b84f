#include "daemon/stages/net_stage.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <chrono>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "daemon/service/logging.hpp"
#include "daemon/service/process_load.hpp"
#include "daemon/service/systemd_status.hpp"
#include "daemon/service/watchdog.hpp"
#include "daemon/stages/mesh_socket.hpp"
#include "daemon/stages/subscription_server.hpp"
#include "net/mesh/peer_link.hpp"
#include "net/udp_socket.hpp"

namespace crepes {
namespace {

constexpr int kMaxDatagramsAtOnce = 256;
constexpr int kPollTimeoutMs = 100;

/// Those that are heard.
std::vector<RobotId> ids_of(const NetSettings& settings) {
  std::vector<RobotId> ids;
  for (const auto& [id, name] : settings.members)
    if (!settings.trust.excluded.contains(id)) ids.push_back(id);
  return ids;
}

SendSettings salted(SendSettings settings) {
  settings.session_salt = random_salt();
  return settings;
}

/// Who could speak for whom; empty if each robot only for itself.
std::string key_warning(const NetSettings& settings) {
  const std::vector<RobotId> ids = ids_of(settings);
  const auto signing = static_cast<std::size_t>(
      std::ranges::count_if(ids, [&](RobotId id) { return settings.trust.keys.contains(id); }));
  if (signing == ids.size()) return "";
  const char* const who =
      settings.net.key_file.empty() ? "anybody on the mesh" : "any robot of the swarm";
  if (signing == 0) return fmt::format("{} could speak for another robot: crepesctl keygen", who);
  return fmt::format("{} could speak for {} of {} robots, which have no public_key", who,
                     ids.size() - signing, ids.size());
}

/// The net thread's state.
class NetLoop {
 public:
  NetLoop(const NetStage& stage, const Clock& clock)
      : stage_(stage),
        clock_(clock),
        settings_(stage.settings.receive().value()),
        start_(clock.now()),
        link_(settings_.self, ids_of(settings_), salted(settings_.send)),
        mesh_(settings_.net) {
    config_status_.since = start_;
    link_.set_trust(settings_.trust);
    air_totals_.at = start_;
    open_server();
  }

  void reconfigure(const NetSettings& settings) {
    const NetSettings before = std::exchange(settings_, settings);
    link_.set_members(ids_of(settings_));
    link_.set_trust(settings_.trust);
    link_.set_pacing(settings_.send);
    if (before.net.interface != settings_.net.interface || before.net.port != settings_.net.port ||
        before.net.key_file != settings_.net.key_file ||
        before.net.robot_key_file != settings_.net.robot_key_file ||
        before.key_identity != settings_.key_identity) {
      mesh_ = MeshSocket(settings_.net);
    }
    if (before.subscription.listen != settings_.subscription.listen ||
        before.subscription.port != settings_.subscription.port) {
      open_server();
    } else {
      server_->reconfigure(settings_.members, settings_.subscription);
    }
  }

  void run_once() {
    wait();
    receive();
    forward(clock_.now());
    stage_.inbox.clear_wakeup();
    while (auto input = stage_.inbox.try_pop()) {
      std::visit([this](auto& what) { handle(what); }, *input);
      receive();  // arrivals are stamped here: clock offsets must not wait for all the sending
    }
    if (auto status = stage_.config_status.try_pop()) config_status_ = std::move(*status);
    server_->serve(clock_.now());
    if (clock_.now() >= next_second_) every_second();
  }

 private:
  void every_second() {
    next_second_ = clock_.now() + std::chrono::seconds{1};
    key_monitor_.update(link_);
    mesh_.follow_address(clock_.now());
    server_->open_missing();
    const AirTotals before = std::exchange(air_totals_, link_.air_totals(clock_.now()));
    air_ = air_share(before, air_totals_, settings_.send.broadcasts);
    notify_service();
  }

  [[nodiscard]] std::string mesh_fault() const {
    const std::string doubled = doubled_ids_.fault(clock_.now());
    if (!mesh_.fault().empty()) return mesh_.fault();
    return doubled.empty() ? key_monitor_.fault() : doubled;
  }

  [[nodiscard]] std::string mesh_warning() const {
    std::string keys = key_warning(settings_);
    if (!mesh_.keys_may_be_swapped()) return keys;
    return std::string(kKeysUnlocked) + (keys.empty() ? "" : "; ") + keys;
  }

  /// Sends the status line to systemd if it has changed.
  void notify_service() {
    std::string line = systemd_status(status());
    if (line == systemd_status_) return;
    Watchdog::notify_status(line);
    systemd_status_ = std::move(line);
  }

  /// Subscribers at the old addresses are lost.
  void open_server() {
    server_.reset();
    server_.emplace(settings_.self, settings_.members, settings_.subscription,
                    [this] { return status(); });
  }

  void wait() {
    std::vector<pollfd> watched;
    const auto watch = [&](int fd) { watched.push_back({fd, POLLIN, 0}); };
    watch(stage_.inbox.descriptor());
    watch(mesh_.descriptor());  // poll ignores -1
    for (const int fd : server_->descriptors()) watch(fd);
    ::poll(watched.data(), watched.size(), timeout_ms());
  }

  /// Until there is something to forward.
  [[nodiscard]] int timeout_ms() const {
    using std::chrono::milliseconds;
    const auto next = link_.next_forward();
    if (!next) return kPollTimeoutMs;
    const auto wait = std::chrono::ceil<milliseconds>(*next - clock_.now()).count();
    return static_cast<int>(std::clamp<milliseconds::rep>(wait, 0, kPollTimeoutMs));
  }

  void receive() {
    for (int i = 0; i < kMaxDatagramsAtOnce; ++i) {
      UdpSocket* socket = mesh_.get(clock_.now());
      if (socket == nullptr) return;
      Result<std::optional<Datagram>> datagram = socket->receive(std::chrono::milliseconds{0});
      const Timestamp arrival = clock_.now();
      if (!datagram) return mesh_.close_for_retry(datagram.error(), arrival);
      if (!*datagram) return;
      if (auto report = link_.receive((*datagram)->bytes, arrival, mesh_.seal(), (*datagram)->from))
        stage_.on_report(std::move(*report));
      doubled_ids_.update(link_, (*datagram)->from, arrival);
    }
  }

  void handle(const Outputs& outputs) {
    // Subscribers first: a report is stamped when it leaves, so its delay does no harm.
    if (!outputs.poses.empty()) server_->publish(outputs.poses, clock_.now());
    if (outputs.report) broadcast(*outputs.report, clock_.now());
  }
  void handle(EstimatorStatus& status) { estimator_ = std::move(status); }
  void handle(SensorStatus& status) { sensors_[status.name] = std::move(status); }

  void forward(Timestamp now) {
    for (const auto& datagram : link_.forwards(now)) send(datagram, now);
  }

  void broadcast(const Report& report, Timestamp now) {
    // The keys are read when the socket is opened.
    if (link_.is_due(now) && mesh_.get(now) != nullptr)
      send(link_.compose(report, now, mesh_.seal(), mesh_.signer()), now);
  }

  void send(std::span<const std::uint8_t> datagram, Timestamp now) {
    UdpSocket* socket = mesh_.get(now);
    if (socket == nullptr) return;
    const Result<void> sent = socket->broadcast(datagram);
    if (sent) return mesh_.end_fault();
    ++unsent_;
    // A congested mesh is no reason to close the socket, which may hold datagrams to be read.
    if (sent.error().code != ErrorCode::kBusy) mesh_.close_for_retry(sent.error(), now);
  }

  [[nodiscard]] SystemStatus status() const {
    SystemStatus status;
    status.self = settings_.self;
    const auto own = settings_.members.find(settings_.self);
    if (own != settings_.members.end()) status.name = own->second;
    status.stamp = clock_.now();
    status.uptime_s = to_seconds(status.stamp - start_);
    status.cpu_s = process_cpu_s();
    status.rss_mb = process_rss_mb();
    status.config = config_status_;
    status.config_age_s = to_seconds(status.stamp - config_status_.since);
    for (const auto& [name, sensor] : sensors_) status.sensors.push_back(sensor);
    status.sensors.push_back({"mesh", 0.0, mesh_fault().empty(), mesh_fault(), {}});
    if (!server_->fault().empty())
      status.sensors.push_back({"subscription", 0.0, false, server_->fault(), {}});
    status.estimator = estimator_;
    status.clocks = link_.clocks();
    status.traffic = link_.traffic(status.stamp);
    status.mesh = {.is_sealed = mesh_.seal().has_value(),
                   .is_signed = mesh_.signer().has_value(),
                   .warning = mesh_warning(),
                   .air = air_};
    status.queues = stage_.queues();
    status.network = link_.counters().totals();
    status.network.emplace_back("reports_unsent", unsent_);
    for (auto& counter : server_->counters()) status.network.push_back(std::move(counter));
    name_unknown_clocks(status);
    return status;
  }

  const NetStage& stage_;
  const Clock& clock_;
  NetSettings settings_;
  ConfigStatus config_status_;
  Timestamp start_;
  PeerLink link_;
  MeshSocket mesh_;
  KeyMismatchMonitor key_monitor_;
  DoubledIdMonitor doubled_ids_;
  AirTotals air_totals_;
  AirShare air_;
  std::uint64_t unsent_ = 0;
  std::optional<SubscriptionServer> server_;
  EstimatorStatus estimator_;
  std::map<std::string, SensorStatus> sensors_;
  std::string systemd_status_;
  Timestamp next_second_ = kNever;  ///< when the next second begins
};

}  // namespace

NetSettings net_settings(const Config& config) {
  NetSettings settings{.self = config.robot.id,
                       .members = {},
                       .trust = mesh_trust(config),
                       .net = config.net,
                       .send = send_settings(config),
                       .subscription = config.subscription,
                       .key_identity = {}};
  for (const MemberConfig& member : config.swarm.members) settings.members[member.id] = member.name;
  if (!config.net.key_file.empty()) {
    const Result<MeshKey> key = read_mesh_key(config.net.key_file);
    settings.key_identity = key ? fingerprint(*key) : key.error().message;
  }
  if (!config.net.robot_key_file.empty()) {
    const Result<RobotKey> key = read_robot_key(config.net.robot_key_file);
    settings.key_identity += key ? to_text(public_key_of(*key)) : key.error().message;
  }
  return settings;
}

NetInbox::NetInbox(std::size_t capacity)
    : inputs_(capacity, Overflow::kDropOldest), wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

// Without an eventfd, or with its counter full, the reader still polls every 100 ms.
void NetInbox::push(NetInput input) {
  inputs_.push(std::move(input));
  ::eventfd_write(wake_.get(), 1);
}

void NetInbox::clear_wakeup() {
  eventfd_t ignored = 0;
  ::eventfd_read(wake_.get(), &ignored);
}

void run_net(const NetStage& stage, const StageContext& context, const std::stop_token& stop) {
  NetLoop loop(stage, context.clock);
  while (!stop.stop_requested()) {
    context.iterations.add();
    if (const auto renewed = stage.settings.receive()) loop.reconfigure(*renewed);
    loop.run_once();
  }
}

}  // namespace crepes
