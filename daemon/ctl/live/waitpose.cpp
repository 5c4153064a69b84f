#include "daemon/ctl/live/waitpose.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>

#include "daemon/ctl/live/full_status.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/live/neighbor_view.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/base/monotonic_clock.hpp"

namespace crepes {
namespace {

using namespace std::chrono_literals;

/// Poses, and why there is none; of all neighbors until it is known which one is meant.
client::Requests requests_about(std::optional<std::uint16_t> peer) {
  return {.polls = {{.peer = peer, .period_s = 0.25}}};
}

/// The messages so far, and why the pose is not sufficient yet.
class Wait {
 public:
  explicit Wait(const WaitposeOptions& options)
      : options_(options), why_(no_answer_from(options.daemon).message) {}

  [[nodiscard]] const std::string& why() const { return why_; }
  /// The daemon refuses, and would go on doing so.
  [[nodiscard]] bool is_refused() const { return is_refused_; }
  /// The neighbor's id, once it is found.
  [[nodiscard]] std::optional<std::uint16_t> peer() const { return peer_; }

  /// In all that the daemon knows, which is nothing right after its start.
  void find_peer(const client::Status& status) {
    if (const auto id = neighbor_named(status, options_.peer)) {
      peer_ = id->value;
    } else if (!status.neighbors.empty()) {
      refuse("it is no other robot of this swarm");
    }
  }

  /// The answer, once the pose is sufficient.
  [[nodiscard]] std::optional<std::string> handle(const client::Answer& answer) {
    if (const auto* status = std::get_if<client::Status>(&answer.message)) handle_status(*status);
    if (const auto* refusal = std::get_if<client::Error>(&answer.message))
      refuse("daemon: " + refusal->message);
    const auto* heard = std::get_if<client::Pose>(&answer.message);
    if (heard == nullptr || heard->peer != peer_) return std::nullopt;
    const double sigma_m = sigma_of(neighbor_pose_of(*heard).T_B_N.covariance).position_m;
    if (options_.max_sigma_m && !(sigma_m <= *options_.max_sigma_m)) {
      why_ = fmt::format("its position is known to {} m only", fixed(sigma_m, 3));
      return std::nullopt;
    }
    return options_.json ? answer.text : line_of(*heard, sigma_m);
  }

 private:
  void handle_status(const client::Status& status) {
    const auto neighbor =
        std::ranges::find(status.neighbors, peer_, &client::Status::Neighbor::peer);
    if (neighbor != status.neighbors.end() && neighbor->state == "none") why_ = neighbor->reason;
  }

  void refuse(std::string reason) {
    why_ = std::move(reason);
    is_refused_ = true;
  }

  static std::string line_of(const client::Pose& heard, double sigma_m) {
    const client::Vector& p = heard.position;
    return fmt::format("{} {} at {} {} {} m, sigma {} m", heard.name, name_of(heard.mode),
                       fixed(p.x, 3), fixed(p.y, 3), fixed(p.z, 3), fixed(sigma_m, 3));
  }

  const WaitposeOptions& options_;
  std::optional<std::uint16_t> peer_;
  std::string why_;
  bool is_refused_ = false;
};

}  // namespace

Result<std::string> wait_for_pose(const WaitposeOptions& options) {
  auto daemon = connect(options.daemon, requests_about({}));
  if (!daemon) return tl::unexpected(daemon.error());
  const MonotonicClock clock;
  const Timestamp end = clock.now() + from_seconds(options.timeout_s);
  Wait wait(options);
  StopSignals stop;
  const KeyReader keys;
  while (clock.now() < end) {
    if (stop.requested() || keys.next() == 'q')
      return fail(ErrorCode::kNotFound, "stopped: " + wait.why());
    const auto answer = daemon->receive(50ms);
    if (!answer) continue;
    if (const auto found = wait.handle(*answer)) return *found + "\n";
    if (!wait.peer() && !wait.is_refused()) {
      if (const auto status = request_full_status(options.daemon)) wait.find_peer(status->message);
      if (wait.peer()) daemon->ask(requests_about(wait.peer()));
    }
    if (wait.is_refused()) break;
  }
  if (wait.is_refused())
    return fail(ErrorCode::kNotFound, fmt::format("robot {}: {}", options.peer, wait.why()));
  return fail(ErrorCode::kNotFound, fmt::format("no pose of robot {} within {} s: {}", options.peer,
                                                fixed(options.timeout_s, 1), wait.why()));
}

}  // namespace crepes
