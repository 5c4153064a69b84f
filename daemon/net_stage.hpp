/// The loop around the mesh and the subscribers.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <variant>
#include <vector>

#include "daemon/bounded_queue.hpp"
#include "daemon/sensor_stages.hpp"
#include "drivers/unique_fd.hpp"
#include "estimator/core/clock.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/event.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/swarm/estimator.hpp"

namespace crepes {

/// What other threads tell the net thread.
using NetInput = std::variant<Outputs, EstimatorStatus, SensorStatus>;

/// A queue whose reader sleeps in poll(2). `push` is thread-safe; `descriptor` becomes readable
/// when there is something to pop.
class NetInbox {
 public:
  explicit NetInbox(std::size_t capacity);

  void push(NetInput input);
  [[nodiscard]] std::optional<NetInput> try_pop() { return inputs_.try_pop(); }
  [[nodiscard]] int descriptor() const { return wake_.get(); }
  /// To be called before the pops that empty it.
  void clear_wake();
  [[nodiscard]] std::uint64_t dropped() const { return inputs_.dropped(); }

 private:
  BoundedQueue<NetInput> inputs_;
  UniqueFd wake_;
};

/// What the net thread works with. All references must outlive it.
struct NetStage {
  const Config& config;
  NetInbox& inbox;
  BoundedQueue<ConfigStatus>& config_status;
  std::function<void(ReceivedReport)> on_report;
  std::function<std::vector<QueueStatus>()> queues;  ///< thread-safe
};

/// Exchanges reports with peers and serves subscribers until `stop`.
void run_net(const NetStage& stage, const StageContext& context, const std::stop_token& stop);

}  // namespace crepes
