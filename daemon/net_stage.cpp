#include "daemon/net_stage.hpp"

#include <poll.h>
#include <sys/eventfd.h>

#include <chrono>
#include <map>
#include <string>
#include <utility>

#include "daemon/logging.hpp"
#include "daemon/mesh_socket.hpp"
#include "daemon/process_load.hpp"
#include "daemon/service_line.hpp"
#include "daemon/subscription_server.hpp"
#include "daemon/watchdog.hpp"
#include "net/peer_link.hpp"
#include "net/udp_socket.hpp"

namespace crepes {
namespace {

constexpr int kMaxDatagramsAtOnce = 256;
constexpr int kPollTimeoutMs = 100;

std::vector<RobotId> ids_of(const SwarmConfig& swarm) {
  std::vector<RobotId> ids;
  for (const MemberConfig& member : swarm.members) ids.push_back(member.id);
  return ids;
}

/// The net thread's state.
class NetLoop {
 public:
  NetLoop(const NetStage& stage, const Clock& clock)
      : stage_(stage),
        clock_(clock),
        config_(stage.config),
        start_(clock.now()),
        link_(config_.robot.id, ids_of(config_.swarm)),
        mesh_(config_.net) {
    config_status_.since = start_;
    open_server();
  }

  void reconfigure(const Config& config) {
    const Config before = std::exchange(config_, config);
    link_.set_members(ids_of(config_.swarm));
    // Behind the same name there may be another key by now.
    if (before.net.interface != config_.net.interface || before.net.port != config_.net.port ||
        before.net.key_file != config_.net.key_file || !config_.net.key_file.empty()) {
      mesh_ = MeshSocket(config_.net);
    }
    if (before.subscription.listen != config_.subscription.listen ||
        before.subscription.port != config_.subscription.port) {
      open_server();
    } else {
      server_->reconfigure(config_);
    }
  }

  void turn() {
    wait();
    receive();
    stage_.inbox.clear_wake();
    while (auto input = stage_.inbox.try_pop()) {
      std::visit([this](auto& what) { on(what); }, *input);
      receive();  // arrivals are stamped here: clock offsets must not wait for all the sending
    }
    if (auto status = stage_.config_status.try_pop()) config_status_ = std::move(*status);
    server_->serve(clock_.now());
    if (clock_.now() >= second_) every_second();
  }

 private:
  void every_second() {
    second_ = clock_.now() + std::chrono::seconds{1};
    key_watch_.look(link_);
    tell_service();
  }

  [[nodiscard]] std::string mesh_fault() const {
    return mesh_.fault().empty() ? key_watch_.fault() : mesh_.fault();
  }

  /// If there is news.
  void tell_service() {
    std::string line = service_line(status());
    if (line == service_line_) return;
    Watchdog::tell_status(line);
    service_line_ = std::move(line);
  }

  /// Those who subscribed at other addresses are gone.
  void open_server() {
    server_.reset();
    server_.emplace(config_, [this] { return status(); });
    for (const std::string& fault : server_->faults()) log_message(LogLevel::kWarning, fault);
  }

  void wait() {
    std::vector<pollfd> watched;
    const auto watch = [&](int fd) { watched.push_back({fd, POLLIN, 0}); };
    watch(stage_.inbox.descriptor());
    watch(mesh_.descriptor());  // -1 is passed over
    for (const int fd : server_->descriptors()) watch(fd);
    ::poll(watched.data(), watched.size(), kPollTimeoutMs);
  }

  void receive() {
    for (int i = 0; i < kMaxDatagramsAtOnce; ++i) {
      UdpSocket* socket = mesh_.get(clock_.now());
      if (socket == nullptr) return;
      Result<std::optional<Datagram>> datagram = socket->receive(std::chrono::milliseconds{0});
      const Timestamp arrival = clock_.now();
      if (!datagram) return mesh_.failed(datagram.error(), arrival);
      if (!*datagram) return;
      if (auto report = link_.receive((*datagram)->bytes, arrival, mesh_.seal()))
        stage_.on_report(std::move(*report));
    }
  }

  void on(const Outputs& outputs) {
    // Programs first: a report's stamp says when it leaves, so its wait does no harm.
    if (!outputs.poses.empty()) server_->publish(outputs.poses, clock_.now());
    if (outputs.report) broadcast(*outputs.report, clock_.now());
  }
  void on(EstimatorStatus& status) { estimator_ = std::move(status); }
  void on(SensorStatus& status) { sensors_[status.name] = std::move(status); }

  void broadcast(const Report& report, Timestamp now) {
    UdpSocket* socket = mesh_.get(now);
    if (socket == nullptr) return;
    const Result<void> sent = socket->broadcast(link_.compose(report, now, mesh_.seal()));
    if (sent) return;
    ++unsent_;
    // A congested mesh is no reason to close the socket, with all that waits in it to be read.
    if (sent.error().code != ErrorCode::kBusy) mesh_.failed(sent.error(), now);
  }

  [[nodiscard]] SystemStatus status() const {
    SystemStatus status;
    status.self = config_.robot.id;
    for (const MemberConfig& member : config_.swarm.members) {
      if (member.id == status.self) status.name = member.name;
    }
    status.stamp = clock_.now();
    status.uptime_s = to_seconds(status.stamp - start_);
    status.cpu_s = process_cpu_s();
    status.rss_mb = process_rss_mb();
    status.config = config_status_;
    status.config_age_s = to_seconds(status.stamp - config_status_.since);
    for (const auto& [name, sensor] : sensors_) status.sensors.push_back(sensor);
    status.sensors.push_back({"mesh", 0.0, mesh_fault().empty(), mesh_fault(), {}});
    status.estimator = estimator_;
    status.clocks = link_.clocks();
    status.traffic = link_.traffic(status.stamp);
    status.queues = stage_.queues();
    status.network = link_.counters();
    status.network.emplace_back("reports_unsent", unsent_);
    for (auto& counter : server_->counters()) status.network.push_back(std::move(counter));
    return status;
  }

  const NetStage& stage_;
  const Clock& clock_;
  Config config_;
  ConfigStatus config_status_;
  Timestamp start_;
  PeerLink link_;
  MeshSocket mesh_;
  KeyWatch key_watch_;
  std::uint64_t unsent_ = 0;
  std::optional<SubscriptionServer> server_;
  EstimatorStatus estimator_;
  std::map<std::string, SensorStatus> sensors_;
  std::string service_line_;
  Timestamp second_{};  ///< when this one is over
};

}  // namespace

NetInbox::NetInbox(std::size_t capacity)
    : inputs_(capacity, Overflow::kDropOldest), wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

// Without an eventfd, or with its counter full, the reader still looks every 100 ms.
void NetInbox::push(NetInput input) {
  inputs_.push(std::move(input));
  ::eventfd_write(wake_.get(), 1);
}

void NetInbox::clear_wake() {
  eventfd_t ignored = 0;
  ::eventfd_read(wake_.get(), &ignored);
}

void run_net(const NetStage& stage, const StageContext& context, const std::stop_token& stop) {
  NetLoop loop(stage, context.clock);
  while (!stop.stop_requested()) {
    context.turns.add();
    if (const auto config = context.settings.try_pop()) loop.reconfigure(*config);
    loop.turn();
  }
}

}  // namespace crepes
