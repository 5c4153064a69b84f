/// One daemon, asked for what the open pages show.
#pragma once

#include <string>

#include "daemon/ctl/view/live_messages.hpp"
#include "net/client/daemon_client.hpp"

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
  LiveFeed(DaemonClient client, LiveMessages messages)
      : client_(std::move(client)), messages_(std::move(messages)) {}
  void ask(Timestamp now, Interest interest);

  DaemonClient client_;
  LiveMessages messages_;
  Timestamp next_request_{};
  int requests_ = 0;
  bool is_subscribed_ = false;
};

}  // namespace crepes
