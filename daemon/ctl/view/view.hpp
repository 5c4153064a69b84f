/// crepesctl view: a page that shows a live swarm or a replay in a browser.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// Options of `crepesctl view`.
struct ViewOptions {
  std::string listen = "127.0.0.1:8080";
  DaemonAddress daemon;
  std::vector<std::string> also;  ///< ADDRESS:PORT of further daemons
  /// recording.socket of the daemon and of the further ones; empty, or fewer: no pictures
  std::vector<std::string> sockets{"/run/crepes/record"};
  std::filesystem::path config = "/etc/crepes/crepesd.yaml";  ///< of the daemon, for view.control
  std::filesystem::path replay;                               ///< empty: live
  std::filesystem::path swarm;       ///< the data set with the truth of the replay
  std::filesystem::path token_file;  ///< empty: a random token where one is needed
  bool open = false;                 ///< start the desktop's browser
  std::function<Result<void>(const std::string& url)> on_ready{};  ///< called once, when listening
};

/// Serves the page until a signal arrives or q is typed. The daemon may start, stop and start again
/// meanwhile.
[[nodiscard]] Result<void> view(const ViewOptions& options);

}  // namespace crepes
