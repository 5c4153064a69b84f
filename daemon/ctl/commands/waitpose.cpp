#include "daemon/ctl/live/waitpose.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_waitpose(CommandLine& line) {
  auto& options = line.make<WaitposeOptions>();
  CLI::App* sub =
      line.add("waitpose",
               "Wait for a neighbor's pose; exit code 1 and the reason if there is none in time");
  add_daemon_options(sub, options.daemon);
  sub->add_option("--peer", options.peer, "the neighbor's name or id")
      ->required()
      ->check(robot_name_or_id());
  sub->add_option("--timeout", options.timeout_s, "seconds to wait")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 1e6));
  sub->add_option_function<double>(
         "--max-sigma", [&options](double sigma_m) { options.max_sigma_m = sigma_m; },
         "wait until the sigma of its position is at most this [m]")
      ->check(above_zero());
  add_json_flag(sub, options.json, "the daemon's own POSE");
  line.run(sub, [&options] { return print_result(wait_for_pose(options)); });
}

}  // namespace crepes
