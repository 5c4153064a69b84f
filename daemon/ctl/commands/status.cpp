#include "daemon/ctl/live/status.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_status(CommandLine& line) {
  auto& options = line.make<StatusOptions>();
  CLI::App* sub =
      line.add("status", "Show the state of a daemon: sensors, neighbors, clocks, mesh, load");
  add_daemon_options(sub, options.daemon);
  add_json_flag(sub, options.json, "the daemon's own JSON, as one object");
  line.run(sub, [&options] { return print_result(status(options)); });
}

}  // namespace crepes
