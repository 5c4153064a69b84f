/// The page's data: which robots can be looked at, and what each of them sees.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "daemon/ctl/view/http_message.hpp"
#include "daemon/ctl/view/http_server.hpp"
#include "daemon/ctl/view/live_feed.hpp"
#include "daemon/ctl/view/recorded_feed.hpp"

namespace crepes {

/// Robots are numbered in the order of the feeds; each is a topic of the server.
class Site {
 public:
  using Live = std::vector<LiveFeed>;

  Site(Live live, std::vector<DaemonAddress> daemons)
      : source_(std::move(live)), daemons_(std::move(daemons)) {}
  explicit Site(RecordedFeed recorded) : source_(std::move(recorded)) {}

  /// Whether `path` is data, rather than a file of the page.
  [[nodiscard]] static bool is_data(const std::string& path);
  [[nodiscard]] HttpReply answer(const HttpRequest& request, Timestamp now) const;

  /// Exchanges messages with the daemons and publishes what is new.
  void advance(HttpServer& server, Timestamp now);

 private:
  [[nodiscard]] std::string robots_json() const;
  [[nodiscard]] std::size_t robot_count() const;

  std::variant<Live, RecordedFeed> source_;
  std::vector<DaemonAddress> daemons_;  ///< of the live feeds
  std::string told_robots_;
  Timestamp next_heartbeat_{};
};

}  // namespace crepes
