/// pair_study: how near to the Cramer-Rao bound of a pair both profiles come, on recordings and
/// over many seeds of the simulated world.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "tests/study/load_swarm.hpp"
#include "tests/study/simulated_swarm.hpp"
#include "tests/study/study.hpp"
#include "tests/study/swarm_writer.hpp"

namespace crepes::study {
namespace {

struct Options {
  std::vector<std::string> sets;
  std::vector<std::string> scenarios;
  int seeds = 10;
  int first_seed = 1;
  double duration_s = 40.0;
  double after_s = 5.0;
  std::string write_dir;
};

/// Runs one swarm after the other; false if one failed.
class Study {
 public:
  explicit Study(const Options& options) : options_(options) {}

  bool add(const Result<Swarm>& swarm, const std::string& name) {
    std::fprintf(stderr, "%s ...\n", name.c_str());
    Result<Trial> trial =
        swarm ? run_trial(*swarm, options_.after_s) : tl::unexpected(swarm.error());
    if (!trial) {
      std::fprintf(stderr, "pair_study: %s\n", trial.error().message.c_str());
      return false;
    }
    trial->name = name;
    trials_.push_back(std::move(*trial));
    return true;
  }

  void print() {
    if (!trials_.empty()) std::printf("%s\n", table_of(trials_).c_str());
    std::fflush(stdout);
    trials_.clear();
  }

 private:
  Options options_;
  std::vector<Trial> trials_;
};

int run(const Options& options) {
  Study study(options);
  for (const std::string& dir : options.sets)
    if (!study.add(load_swarm_with_truth(dir), dir)) return 1;
  study.print();
  for (const Scenario& scenario : kScenarios) {
    const auto& wanted = options.scenarios;
    const bool all = std::find(wanted.begin(), wanted.end(), "all") != wanted.end();
    if (!all && std::find(wanted.begin(), wanted.end(), scenario.name) == wanted.end()) continue;
    for (int seed = options.first_seed; seed < options.first_seed + options.seeds; ++seed) {
      const std::string name = std::string(scenario.name) + " " + std::to_string(seed);
      const Swarm swarm = simulate_swarm(scenario, seed, options.duration_s);
      const std::string dir =
          options.write_dir + "/" + std::string(scenario.name) + "-" + std::to_string(seed);
      if (!options.write_dir.empty() && !write_swarm(dir, swarm)) {
        std::fprintf(stderr, "pair_study: %s: cannot be written\n", dir.c_str());
        return 1;
      }
      if (!study.add(swarm, name)) return 1;
    }
    study.print();
  }
  return 0;
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  crepes::study::Options options;
  CLI::App app("pair_study: both profiles against the Cramer-Rao bound of a pair, without graph");
  std::vector<std::string> names{"all"};
  for (const auto& scenario : crepes::study::kScenarios) names.emplace_back(scenario.name);
  app.add_option("SWARM_DIR", options.sets, "recordings with truth and spots");
  app.add_option("--scenario", options.scenarios, "simulated swarms, or all")
      ->check(CLI::IsMember(names));
  app.add_option("--seeds", options.seeds, "simulated swarms of each scenario")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--first-seed", options.first_seed, "the first of them")->capture_default_str();
  app.add_option("--duration", options.duration_s, "of a simulated swarm [s]")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 600.0));
  app.add_option("--after", options.after_s, "seconds at the start that are not scored")
      ->capture_default_str();
  app.add_option("--write", options.write_dir,
                 "also leave every simulated swarm as a data set, DIR/<scenario>-<seed>");
  CLI11_PARSE(app, argc, argv);
  return crepes::study::run(options);
}
