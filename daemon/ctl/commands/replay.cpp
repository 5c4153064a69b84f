#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/swarm_replay.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

std::string text_of(const ReplaySummary& summary, const std::string& out) {
  return std::to_string(summary.robots) + " robots, " + fixed(summary.duration_s, 1) + " s, " +
         std::to_string(summary.poses) + " poses in " + out + "\n";
}

std::string json_of(const ReplaySummary& summary, const std::string& out) {
  return json_line({{"out", out},
                    {"robots", summary.robots},
                    {"duration_s", summary.duration_s},
                    {"poses", summary.poses},
                    {"refused", summary.faults.counts()}});
}

Result<void> run_replay(ReplayOptions options, bool json) {
  options.on_progress = progress_on_terminal();
  const Result<ReplaySummary> summary = replay_swarm(options);
  if (!summary) return tl::unexpected(summary.error());
  for (const std::string& fault : summary->faults.list())
    std::fprintf(stderr, "refused: %s\n", fault.c_str());
  const std::string out = options.out_dir.string();
  return print_result(json ? json_of(*summary, out) : text_of(*summary, out));
}

}  // namespace

void add_replay(CommandLine& line) {
  auto& options = line.keep<ReplayOptions>();
  auto& json = line.keep<bool>();
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
  add_json_flag(sub, json, "one object at the end");
  line.run(sub, [&options, &json] { return run_replay(options, json); });
}

}  // namespace crepes
