#include "daemon/ctl/status.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_status(CommandLine& line) {
  auto& options = line.keep<StatusOptions>();
  CLI::App* sub =
      line.add("status", "One look at a daemon: sensors, neighbors, clocks, mesh, load");
  add_daemon_options(sub, options.daemon);
  add_json_flag(sub, options.json, "the daemon's own words, as one object");
  line.run(sub, [&options] { return print_result(status(options)); });
}

}  // namespace crepes
