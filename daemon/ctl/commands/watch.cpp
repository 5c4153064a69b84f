#include "daemon/ctl/live/watch.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_watch(CommandLine& line) {
  auto& options = line.make<WatchOptions>();
  CLI::App* sub = line.add(
      "watch", "Show a live table of the neighbors' poses, with the reason where there is no pose");
  add_daemon_options(sub, options.daemon);
  add_json_flag(sub, options.json, "the daemon's own objects as they arrive");
  sub->add_option_function<double>(
         "--for", [&options](double seconds) { options.for_s = seconds; },
         "stop after this many seconds")
      ->check(CLI::Range(0.1, 1e6));
  sub->add_flag("--once", options.once, "one table, or with --json its messages, then stop");
  line.run(sub, [&options] { return watch(options); });
}

}  // namespace crepes
