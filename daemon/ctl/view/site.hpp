/// The page's data: which robots can be looked at, and what each of them sees.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <variant>
#include <vector>

#include "daemon/ctl/view/access.hpp"
#include "daemon/ctl/view/camera_feed.hpp"
#include "daemon/ctl/view/http_message.hpp"
#include "daemon/ctl/view/http_server.hpp"
#include "daemon/ctl/view/live_feed.hpp"
#include "daemon/ctl/view/recorded_feed.hpp"

namespace crepes {

/// Robots are numbered in the order of the feeds; each is a topic of the server, and so is each of
/// their cameras.
class Site {
 public:
  using Live = std::vector<LiveFeed>;

  /// `cameras`: of each daemon. `config` is the file of the first, for what the page may change.
  Site(Live live, std::vector<DaemonAddress> daemons, std::vector<CameraFeed> cameras,
       std::filesystem::path config)
      : source_(std::move(live)),
        daemons_(std::move(daemons)),
        cameras_(std::move(cameras)),
        config_(std::move(config)) {}
  explicit Site(RecordedFeed recorded) : source_(std::move(recorded)) {}

  [[nodiscard]] static Access access_to(const std::string& path);
  [[nodiscard]] HttpReply answer(const HttpRequest& request, Timestamp now) const;

  /// Exchanges messages with the daemons and publishes what is new.
  void advance(HttpServer& server, Timestamp now);

 private:
  using Parameters = std::map<std::string, std::string>;
  [[nodiscard]] HttpReply live_answer(const std::string& path, std::size_t robot,
                                      const Parameters& parameters, Timestamp now) const;
  [[nodiscard]] std::size_t camera_topic(std::size_t robot, std::size_t camera) const;
  void advance_cameras(HttpServer& server, Timestamp now);
  /// Adds the robots to `json`, what else the page must know.
  [[nodiscard]] std::string robots_json(nlohmann::ordered_json json) const;
  [[nodiscard]] std::size_t robot_count() const;

  std::variant<Live, RecordedFeed> source_;
  std::vector<DaemonAddress> daemons_;  ///< of the live feeds
  std::vector<CameraFeed> cameras_;     ///< of the live feeds
  std::filesystem::path config_;
  std::string sent_robots_;
  Timestamp next_heartbeat_{};
};

}  // namespace crepes
