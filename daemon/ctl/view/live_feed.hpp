/// One daemon, asked for what the open pages show.
#pragma once

#include <string>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/view/live_messages.hpp"

namespace crepes {

class LiveFeed {
 public:
  /// How much is asked for. Nobody looks: nothing.
  enum class Interest { kNone, kName, kAll };

  [[nodiscard]] static Result<LiveFeed> open(const DaemonAddress& daemon);

  /// Sends the requests that are due and receives all that has arrived; does not wait. A daemon
  /// that does not run, or no route to it, is a silent daemon.
  void exchange(Timestamp now, Interest interest);

  [[nodiscard]] const LiveMessages& messages() const { return messages_; }
  /// See `LiveMessages::drain`.
  [[nodiscard]] std::string drain(Timestamp now) { return messages_.drain(now); }

 private:
  LiveFeed(client::Connection daemon, LiveMessages messages)
      : daemon_(std::move(daemon)), messages_(std::move(messages)) {}
  void ask(Interest interest);

  client::Connection daemon_;
  LiveMessages messages_;
  Interest asked_ = Interest::kNone;
  std::vector<RobotId> asked_about_;  ///< the neighbors
};

}  // namespace crepes
