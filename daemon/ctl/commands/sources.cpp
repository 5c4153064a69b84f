#include "daemon/ctl/live/sources.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_sources(CommandLine& line) {
  auto& options = line.make<SourcesOptions>();
  CLI::App* sub = line.add(
      "sources",
      "Show the measurements behind each neighbor's pose: bearings both ways, ranges, reports; "
      "their rates, ages, and refusals by reason");
  add_daemon_options(sub, options.daemon);
  sub->add_option("--over", options.over_s, "seconds over which rates are counted")
      ->capture_default_str()
      ->check(CLI::Range(0.1, 60.0));
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return print_result(sources(options)); });
}

}  // namespace crepes
