#include "daemon/ctl/live/waitpose.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

#include "daemon/ctl/live/neighbor_view.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/base/monotonic_clock.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

/// The messages so far, and why the pose is not sufficient yet.
class Wait {
 public:
  explicit Wait(const WaitposeOptions& options)
      : options_(options), why_(no_answer_from(options.daemon).message) {}

  [[nodiscard]] const std::string& why() const { return why_; }

  /// The answer, once the pose is sufficient.
  [[nodiscard]] std::optional<std::string> handle(const DaemonAnswer& answer) {
    if (const auto* status = std::get_if<StatusMessage>(&answer.message)) handle_status(*status);
    if (const auto* refusal = std::get_if<ErrorMessage>(&answer.message))
      why_ = "daemon: " + refusal->message;
    const auto* heard = std::get_if<PoseMessage>(&answer.message);
    if (heard == nullptr || heard->pose.neighbor != options_.peer) return std::nullopt;
    const double sigma_m = sigma_of(heard->pose.T_B_N.covariance).position_m;
    if (options_.max_sigma_m && !(sigma_m <= *options_.max_sigma_m)) {
      why_ = fmt::format("its position is known to {} m only", fixed(sigma_m, 3));
      return std::nullopt;
    }
    return options_.json ? answer.text : line_of(*heard, sigma_m);
  }

 private:
  void handle_status(const StatusMessage& status) {
    const auto neighbor =
        std::ranges::find(status.neighbors, options_.peer, &StatusMessage::Neighbor::neighbor);
    const bool known = neighbor != status.neighbors.end();
    if (known && neighbor->state == "none") why_ = neighbor->reason;
    if (!known && !status.neighbors.empty()) why_ = "it is no other robot of this swarm";
  }

  static std::string line_of(const PoseMessage& heard, double sigma_m) {
    const Eigen::Vector3d& p = heard.pose.T_B_N.pose.p;
    return fmt::format("{} {} at {} {} {} m, sigma {} m", heard.name, name_of(heard.pose.mode),
                       fixed(p.x(), 3), fixed(p.y(), 3), fixed(p.z(), 3), fixed(sigma_m, 3));
  }

  const WaitposeOptions& options_;
  std::string why_;
};

}  // namespace

Result<std::string> wait_for_pose(const WaitposeOptions& options) {
  Result<DaemonClient> client = DaemonClient::open(options.daemon);
  if (!client) return tl::unexpected(client.error());
  const MonotonicClock clock;
  const Timestamp end = clock.now() + from_seconds(options.timeout_s);
  Timestamp renewal = clock.now();
  Wait wait(options);
  while (clock.now() < end) {
    if (clock.now() >= renewal) {
      (void)client->watch();  // the daemon may not run yet
      (void)client->poll(options.peer);
      renewal = clock.now() + 250ms;
    }
    const auto answer = client->receive(50ms);
    if (!answer || !*answer) continue;
    if (auto found = wait.handle(**answer)) {
      (void)client->unwatch();
      return *found + "\n";
    }
  }
  return fail(ErrorCode::kNotFound,
              fmt::format("no pose of robot {} within {} s: {}", options.peer.value,
                          fixed(options.timeout_s, 1), wait.why()));
}

}  // namespace crepes
