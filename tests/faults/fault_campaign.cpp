/// fault_campaign: swarms with faults over many seeds. See README.md.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "estimator/core/constants.hpp"
#include "tests/faults/fault_table.hpp"
#include "tests/faults/kept.hpp"
#include "tests/faults/trial.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::faults {
namespace {

struct Options {
  std::uint64_t first = 1;
  std::uint64_t count = 100;
  std::uint64_t part = 0;  ///< of the worlds
  std::uint64_t parts = 1;
  bool takes_long = false;
  bool flies_kept = false;
  std::string scenario;
  std::string log;
  std::string trial;
  std::string errors;
  std::vector<std::string> tables;
};

void print(const Verdict& verdict) {
  fmt::print("{}\n", is_broken(verdict) ? kept_line(verdict) : to_string(verdict.trial));
  fmt::print("  smallest: {}\n", to_string(Trial{verdict.trial.world, verdict.smallest}));
  for (const Broken& one : verdict.broken) fmt::print("    {}\n", one.text);
  std::fflush(stdout);
}

/// A line for every pose of a schedule, and of the same swarm without faults.
bool write_errors(const Trial& trial, const std::string& file) {
  std::ofstream out(file);
  out << "faults,observer,neighbor,t_s,mode,error_m,error_deg,mahalanobis2\n";
  for (const bool with_faults : {false, true})
    for (const auto& [pair, trace] : traces_of(trial, with_faults))
      for (const PoseError& e : trace.errors())
        out << fmt::format("{:d},{},{},{:.3f},{},{:.4f},{:.3f},{:.2f}\n", with_faults,
                           pair.first.value, pair.second.value, e.true_s, name_of(e.mode),
                           e.error_m, e.error_rad * kDegPerRad, e.mahalanobis2);
  if (!out.flush()) fmt::print(stderr, "{}: cannot be written\n", file);
  return out.good();
}

/// One schedule, as it is printed or kept.
std::uint64_t run_one(const std::string& line, const std::string& errors) {
  const auto trial = parse_trial(line);
  if (!trial) {
    fmt::print(stderr, "no schedule: {}\n", line);
    return 1;
  }
  if (!errors.empty()) return write_errors(*trial, errors) ? 0 : 1;
  std::uint64_t failed = 0;
  try_all({*trial}, [&](const Verdict& verdict) {
    failed += verdict.broken.empty() ? 0 : 1;
    print(verdict);
    fmt::print("    recovery {:.1f} s, heap {:.1f} MB\n", verdict.recovery_s,
               static_cast<double>(verdict.heap_growth) * 1e-6);
  });
  return failed;
}

/// Those of kept.txt: prints what is worse than allowed, and what is kept here although it is open.
std::uint64_t run_kept(const Options& options) {
  std::map<std::string, std::vector<Trial>> by_world;
  std::map<std::string, std::map<Promise, double>> allowed;
  for (const KeptTrial& kept : kept_trials()) {
    by_world[to_string(kept.trial.world)].push_back(kept.trial);
    allowed[to_string(kept.trial)] = kept.allowed;
  }
  std::uint64_t failed = 0;
  std::uint64_t world = 0;
  for (const auto& [name, trials] : by_world) {
    if (world++ % options.parts != options.part) continue;
    try_all(
        trials,
        [&](const Verdict& verdict) {
          const auto lines = unexpected(verdict, allowed[to_string(verdict.trial)]);
          failed += lines.empty() ? 0 : 1;
          if (!lines.empty()) print(verdict);
          for (const std::string& line : kept_again(verdict, allowed[to_string(verdict.trial)]))
            fmt::print("{}\n", line);
        },
        [](const Verdict&) { return false; });
  }
  return failed;
}

/// Whole worlds, every `parts`-th.
std::uint64_t run(const Options& options) {
  const FaultTimes& times = options.takes_long ? kLong : kShort;
  if (!options.trial.empty()) return run_one(options.trial, options.errors);
  if (options.flies_kept) return run_kept(options);
  std::ofstream log(options.log);
  std::uint64_t failed = 0;
  const std::uint64_t end = options.first + options.count;
  std::vector<Trial> trials;
  for (std::uint64_t seed = options.first; seed < end; ++seed) {
    const World flown = world_of(seed, options.scenario);
    trials.push_back(trial_of(seed, times, options.scenario));
    if (seed + 1 < end && world_of(seed + 1, options.scenario) == flown) continue;
    const std::uint64_t world = (seed - 1) / kSeedsPerWorld;
    if (world % options.parts == options.part) {
      try_all(trials, [&](const Verdict& verdict) {
        log << log_line(verdict) << std::endl;  // NOLINT(performance-avoid-endl): a night's work
        failed += verdict.broken.empty() ? 0 : 1;
        if (!verdict.broken.empty()) print(verdict);
      });
    }
    trials.clear();
  }
  return failed;
}

}  // namespace
}  // namespace crepes::faults

int main(int argc, char** argv) {
  CLI::App app{"Swarms with faults on virtual time, by seed", "fault_campaign"};
  crepes::faults::Options options;
  app.add_option("--first", options.first, "the first seed")->capture_default_str();
  app.add_option("--seeds", options.count, "how many")->capture_default_str();
  app.add_option("--part", options.part, "of the worlds, from 0")->capture_default_str();
  app.add_option("--parts", options.parts, "in how many parts")->capture_default_str();
  app.add_flag("--long", options.takes_long, "faults of up to half a minute");
  std::vector<std::string> scenarios;
  for (const auto& scenario : crepes::study::kScenarios) scenarios.emplace_back(scenario.name);
  app.add_option("--scenario", options.scenario,
                 "of the studies; without it, four, occluded and cluttered in turn")
      ->check(CLI::IsMember(scenarios));
  app.add_option("--log", options.log, "a line for every trial goes to this file");
  app.add_option("--trial", options.trial, "only flies this schedule, as kept.txt has it");
  app.add_option("--errors", options.errors,
                 "with --trial: only writes the error of every pose, with and without the faults")
      ->needs("--trial");
  app.add_flag("--kept", options.flies_kept, "only flies the schedules of kept.txt");
  app.add_option("--table", options.tables, "only prints the table of these logs");
  CLI11_PARSE(app, argc, argv);
  if (!options.tables.empty()) {
    fmt::print("{}", crepes::faults::table_of(options.tables));
    return 0;
  }
  const std::uint64_t failed = crepes::faults::run(options);
  return failed == 0 ? 0 : 1;
}
