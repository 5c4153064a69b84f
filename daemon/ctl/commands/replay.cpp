#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/replay/swarm_replay.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

std::string text_of(const ReplaySummary& summary, const std::string& out) {
  return fmt::format("{} robot{}, {} s, {} poses in {}\n", summary.robots,
                     summary.robots == 1 ? "" : "s", fixed(summary.duration_s, 1), summary.poses,
                     out);
}

std::string json_of(const ReplaySummary& summary, const std::string& out) {
  return json_line({{"out", out},
                    {"robots", summary.robots},
                    {"duration_s", summary.duration_s},
                    {"poses", summary.poses},
                    {"refused", summary.faults.counts()},
                    {"notes", summary.notes}});
}

Result<ReplaySummary> replay_with_progress(ReplayOptions options) {
  const TerminalProgress progress;
  options.on_progress = progress.sink();
  return replay_swarm(options);
}

Result<void> run_replay(const ReplayOptions& options, bool json) {
  const SensorDelays& delays = options.delays;
  if (!delays.robots.empty() && delays.camera_s + delays.uwb_s + delays.imu_s == 0.0)
    return fail(ErrorCode::kUsage, "--delayed: needs --camera-delay, --uwb-delay or --imu-delay");
  const Result<ReplaySummary> summary = replay_with_progress(options);
  if (!summary) return tl::unexpected(summary.error());
  print_skipped(summary->faults);
  if (!json) {
    for (const std::string& note : summary->notes) fmt::print(stderr, "note: {}\n", note);
  }
  const std::string out = options.out_dir.string();
  return print_result(json ? json_of(*summary, out) : text_of(*summary, out));
}

}  // namespace

void add_replay(CommandLine& line) {
  auto& options = line.make<ReplayOptions>();
  auto& json = line.make<bool>();
  CLI::App* sub = line.add(
      "replay", "Run all robots of a recorded swarm on virtual time and write their poses");
  sub->add_option("SWARM_DIR", options.swarm_dir, "the data set")->required();
  sub->add_option("--out", options.out_dir,
                  "directory for <observer>/<neighbor>.csv, .tum and report.json")
      ->required();
  add_choice(
      sub, "--profile", kProfiles, [&options](Profile profile) { options.profile = profile; },
      "filter profile; overrides the configuration files");
  sub->add_flag("--no-graph{false},--graph{true}", options.graph,
                "do not estimate the team as a whole, only pairs");
  sub->add_option_function<std::uint64_t>(
      "--seed", [&options](std::uint64_t seed) { options.seed = seed; },
      "seed of the simulated network; overrides swarm.yaml");
  sub->add_option_function<double>(
         "--loss", [&options](double loss) { options.loss = loss; },
         "share of datagrams that are lost; overrides swarm.yaml")
      ->check(CLI::Range(0.0, 0.99));
  sub->add_option("--burst", options.burst_s,
                  "seconds for which a link loses everything; without it, datagrams are lost one "
                  "by one")
      ->check(CLI::Range(0.0, 60.0));
  CLI::Option* reach =
      sub->add_option("--reach", options.reach_m,
                      "robots further apart do not hear each other, by truth/ [m]; 0: all do")
          ->check(CLI::Range(0.0, 1e6));
  sub->add_flag("--no-forwarding{false},--forwarding{true}", options.forwards,
                "with --reach: no flooding, as by batman-adv; robots still forward "
                "what is marked")
      ->needs(reach);
  const auto delay = [sub](const std::string& option, double& delay_s, const char* sensor) {
    sub->add_option(option, delay_s,
                    std::string("seconds that pass until the daemon has ") + sensor)
        ->check(CLI::Range(0.0, 0.5));
  };
  delay("--camera-delay", options.delays.camera_s, "a picture");
  delay("--uwb-delay", options.delays.uwb_s, "a range");
  delay("--imu-delay", options.delays.imu_s, "an inertial sample");
  sub->add_option("--delayed", options.delays.robots,
                  "robots whose sensors have these delays, by name or id; without it, all")
      ->delimiter(',');
  sub->add_flag("--sealed", options.sealed,
                "seal and sign the datagrams, with keys made for the replay");
  sub->add_flag(
      "--debug-innovations", options.records,
      "also write <neighbor>.innovations.csv and .calibration.csv: every measurement's residual, "
      "sigma, NIS and verdict, and the estimated biases");
  add_json_flag(sub, json, "one object at the end");
  line.run(sub, [&options, &json] { return run_replay(options, json); });
}

}  // namespace crepes
