#include "daemon/ctl/sources.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_sources(CommandLine& line) {
  auto& options = line.keep<SourcesOptions>();
  CLI::App* sub =
      line.add("sources",
               "What each neighbor's pose rests on: bearings each way, ranges, reports; their "
               "rates and ages, and what was refused and why");
  add_daemon_options(sub, options.daemon);
  sub->add_option("--over", options.over_s, "seconds over which rates are counted")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 60.0));
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return print_result(sources(options)); });
}

}  // namespace crepes
