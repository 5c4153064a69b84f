#include <cstdio>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/live_screen.hpp"
#include "daemon/ctl/swarm_replay.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

Result<void> run_replay(ReplayOptions options) {
  options.on_progress = progress_on_terminal();
  const Result<ReplaySummary> summary = replay_swarm(options);
  if (!summary) return tl::unexpected(summary.error());
  for (const std::string& fault : summary->faults.list())
    std::fprintf(stderr, "refused: %s\n", fault.c_str());
  print(std::to_string(summary->robots) + " robots, " + fixed(summary->duration_s, 1) + " s, " +
        std::to_string(summary->poses) + " poses in " + options.out_dir.string() + "\n");
  return {};
}

}  // namespace

void add_replay(CommandLine& line) {
  auto& options = line.keep<ReplayOptions>();
  CLI::App* sub = line.add(
      "replay", "Run all robots of a recorded swarm on virtual time and write their poses");
  sub->add_option("SWARM_DIR", options.swarm_dir, "the data set")->required();
  sub->add_option("--out", options.out_dir,
                  "directory for <observer>/<neighbor>.csv, .tum and report.json")
      ->required();
  add_choice(
      sub, "--profile", kProfiles, [&options](Profile profile) { options.profile = profile; },
      "filter, instead of what the configuration files say");
  sub->add_flag("--no-graph{false},--graph{true}", options.graph, "no pose graph");
  sub->add_option_function<std::uint64_t>(
      "--seed", [&options](std::uint64_t seed) { options.seed = seed; },
      "of the simulated network, instead of swarm.yaml's");
  sub->add_flag(
      "--debug-innovations", options.records,
      "also <neighbor>.innovations.csv and .calibration.csv: every measurement's residual, "
      "sigma, NIS and verdict, and the biases that the filter believes in");
  line.run(sub, [&options] { return run_replay(options); });
}

}  // namespace crepes
