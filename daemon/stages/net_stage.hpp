/// The loop around the mesh and the subscribers.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

#include "config/schema/config.hpp"
#include "config/schema/mesh_slice.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/stage_context.hpp"
#include "drivers/base/unique_fd.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/event.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/swarm/estimator.hpp"
#include "net/subscription/system_status.hpp"

namespace crepes {

/// What other threads send to the net thread.
using NetInput = std::variant<Outputs, EstimatorStatus, SensorStatus>;

/// A queue whose reader sleeps in poll(2). `push` is thread-safe; `descriptor` becomes readable
/// when there is something to pop.
class NetInbox {
 public:
  explicit NetInbox(std::size_t capacity);

  void push(NetInput input);
  [[nodiscard]] std::optional<NetInput> try_pop() { return inputs_.try_pop(); }
  [[nodiscard]] int descriptor() const { return wake_.get(); }
  /// Call it before the pops that empty the queue.
  void clear_wakeup();
  [[nodiscard]] std::uint64_t dropped() const { return inputs_.dropped(); }

 private:
  BoundedQueue<NetInput> inputs_;
  UniqueFd wake_;
};

/// The settings slice of this stage.
struct NetSettings {
  RobotId self{};
  std::map<RobotId, std::string> members;  ///< names, this robot's included
  MeshTrust trust;
  NetConfig net;
  SendSettings send;
  SubscriptionConfig subscription;
  std::string key_identity;  ///< of the keys in the files that `net` names: the same files may
                             ///< hold others later

  [[nodiscard]] bool operator==(const NetSettings&) const = default;
};

/// Reads the key files.
[[nodiscard]] NetSettings net_settings(const Config& config);

/// The inputs and outputs of the net thread. All references must outlive it.
struct NetStage {
  LiveSettings<NetSettings>& settings;
  NetInbox& inbox;
  BoundedQueue<ConfigStatus>& config_status;
  std::function<void(ReceivedReport)> on_report;
  std::function<std::vector<QueueStatus>()> queues;  ///< thread-safe
};

/// Exchanges reports with peers and serves subscribers until `stop`.
void run_net(const NetStage& stage, const StageContext& context, const std::stop_token& stop);

}  // namespace crepes
