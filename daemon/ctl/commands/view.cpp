#include "daemon/ctl/view/view.hpp"

#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"

namespace crepes {

void add_view(CommandLine& line) {
  auto& options = line.make<ViewOptions>();
  auto& json = line.make<bool>();
  CLI::App* sub = line.add(
      "view", "Serve a page that shows a live swarm or a replay in a browser, until interrupted");
  sub->add_option("REPLAY_DIR", options.replay,
                  "output directory of replay; without it, a running daemon is shown");
  sub->add_option("--truth", options.swarm, "the data set of the replay, with its truth/");
  sub->add_option("--listen", options.listen,
                  "where the page is served, ADDRESS:PORT; port 0 is a free one. Beyond loopback "
                  "the page requires the token in the printed address")
      ->capture_default_str();
  sub->add_option("--token-file", options.token_file,
                  "a file with the token, which is then required on loopback too; default: a "
                  "random token beyond loopback");
  add_daemon_options(sub, options.daemon);
  sub->add_option("--also", options.also,
                  "ADDRESS:PORT of another robot's daemon, whose view the page offers; repeatable");
  sub->add_option("--socket", options.sockets,
                  "recording.socket of the daemon, then of each --also, for the cameras' pictures")
      ->capture_default_str();
  sub->add_option("--config", options.config,
                  "the daemon's configuration, which the page may change if view.control is true")
      ->capture_default_str();
  sub->add_flag("--open", options.open, "open the page in the desktop's browser");
  add_json_flag(sub, json, "one object with the address of the page");
  line.run(sub, [&options, &json] {
    options.on_ready = [&json](const std::string& url) {
      return print_result(json ? json_line({{"page", url}}) : url + "\n");
    };
    return view(options);
  });
}

}  // namespace crepes
