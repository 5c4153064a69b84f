/// team_study: how near to the bound of the team its robots come and how honest they are, on
/// recordings and over seeds of the simulated world; and what a faulty member does to the others.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimator/core/constants.hpp"
#include "estimator/graph/graph_config.hpp"
#include "tests/study/load_swarm.hpp"
#include "tests/study/simulated_swarm.hpp"
#include "tests/study/swarm_writer.hpp"
#include "tests/study/team_trial.hpp"

namespace crepes::study {
namespace {

struct Options {
  std::vector<std::string> sets;
  std::vector<std::string> scenarios;
  int seeds = 5;
  int first_seed = 1;
  double duration_s = 40.0;
  double after_s = 5.0;
  bool no_graph = false;
  bool paper = false;
  std::optional<TeamMethod> method;
  bool scaled = false;
  bool bound_only = false;
  std::string liar;
  std::string write_dir;
  int leds = 0;
  double ring_radius_m = LedBoard{}.radius_m;
  bool measured = false;
  std::optional<double> uwb_noise_m;
  std::optional<double> uwb_bias_m;
};

bool complain(const std::string& message) {
  std::fprintf(stderr, "team_study: %s\n", message.c_str());
  return false;
}

/// Runs one swarm after the other; false if one failed.
class Study {
 public:
  explicit Study(const Options& options) : options_(options) {
    trial_.after_s = options.after_s;
    trial_.scaled = options.scaled;
    trial_.replay.graph = !options.no_graph;
    trial_.method = options.method;
    if (options.paper) trial_.replay.profile = Profile::kPaper;
  }

  bool add(Swarm swarm, const SensorPriors& priors, const std::string& name) {
    std::fprintf(stderr, "%s ...\n", name.c_str());
    for (auto& robot : swarm.dataset.robots) {
      RangeNoise& noise = robot.config.uwb.noise;
      noise.noise_m = options_.uwb_noise_m.value_or(noise.noise_m);
      noise.bias_sigma_m = options_.uwb_bias_m.value_or(noise.bias_sigma_m);
    }
    trial_.priors = priors;
    if (options_.bound_only) return add_bound(swarm, name);
    if (options_.liar.empty()) return keep(run_team_trial(swarm, trial_), name, trials_);
    const auto liar = std::find_if(kLiars.begin(), kLiars.end(),
                                   [&](const Liar& l) { return l.name == options_.liar; });
    return keep(run_liar_trial(swarm, *liar, trial_), name, liar_trials_);
  }

  void print() {
    if (!trials_.empty()) std::printf("%s\n", table_of(trials_).c_str());
    if (!liar_trials_.empty()) std::printf("%s\n", table_of(liar_trials_).c_str());
    std::fflush(stdout);
    trials_.clear();
    liar_trials_.clear();
  }

 private:
  template <class Trial>
  bool keep(Result<Trial> trial, const std::string& name, std::vector<Trial>& trials) {
    if (!trial) return complain(trial.error().message);
    trial->name = name;
    trials.push_back(std::move(*trial));
    return true;
  }

  /// A line for each observer: what limits.md lists.
  bool add_bound(const Swarm& swarm, const std::string& name) {
    const TeamBound team = team_bound(swarm, trial_.priors, trial_.after_s);
    for (const SwarmRobot& robot : swarm.dataset.manifest.robots) {
      TeamBound own = team;
      std::erase_if(own, [&](const auto& entry) { return entry.first.first != robot.id; });
      const PairBound all = pooled(own);
      std::printf("%s, %s observing: %.4f m (%.4f), %.3f deg (%.3f)\n", name.c_str(),
                  robot.name.c_str(), all.position_rms_m, all.position_median_m,
                  kDegPerRad * all.rotation_rms_rad, kDegPerRad * all.rotation_median_rad);
    }
    return true;
  }

  Options options_;
  TeamTrialOptions trial_;
  std::vector<TeamTrial> trials_;
  std::vector<LiarTrial> liar_trials_;
};

bool add_seeds(const Options& options, Scenario scenario, Study& study) {
  if (options.leds > 0) {
    scenario.pictured = LedBoard{.leds = options.leds, .radius_m = options.ring_radius_m};
    scenario.are_boards_measured = options.measured;
  }
  for (int seed = options.first_seed; seed < options.first_seed + options.seeds; ++seed) {
    const std::string name = std::string(scenario.name) + " " + std::to_string(seed);
    Swarm swarm = simulate_swarm(scenario, seed, options.duration_s);
    const std::string dir =
        options.write_dir + "/" + std::string(scenario.name) + "-" + std::to_string(seed);
    if (!options.write_dir.empty() && !write_swarm(dir, swarm))
      return complain(dir + ": cannot be written");
    if (!study.add(std::move(swarm), priors_of(scenario), name)) return false;
  }
  return true;
}

int run(const Options& options) {
  Study study(options);
  for (const std::string& dir : options.sets) {
    Result<Swarm> swarm = load_swarm_with_truth(dir);
    if (!(swarm ? study.add(std::move(*swarm), {}, dir) : complain(swarm.error().message)))
      return 1;
  }
  study.print();
  for (const std::string& name : options.scenarios) {
    const auto scenario = std::find_if(kScenarios.begin(), kScenarios.end(),
                                       [&](const Scenario& s) { return s.name == name; });
    if (!add_seeds(options, *scenario, study)) return 1;
    study.print();
  }
  return 0;
}

}  // namespace
}  // namespace crepes::study

int main(int argc, char** argv) {
  crepes::study::Options options;
  CLI::App app("team_study: the estimate of a team against the Cramer-Rao bound of the team");
  std::vector<std::string> scenarios;
  for (const auto& scenario : crepes::study::kScenarios) scenarios.emplace_back(scenario.name);
  std::vector<std::string> liars;
  for (const auto& liar : crepes::study::kLiars) liars.emplace_back(liar.name);
  app.add_option("SWARM_DIR", options.sets, "recordings with truth and spots");
  app.add_option("--scenario", options.scenarios, "simulated swarms")
      ->check(CLI::IsMember(scenarios));
  app.add_option("--seeds", options.seeds, "simulated swarms of each scenario")
      ->capture_default_str()
      ->check(CLI::Range(1, 100000));
  app.add_option("--first-seed", options.first_seed, "the first of them")->capture_default_str();
  app.add_option("--duration", options.duration_s, "of a simulated swarm [s]")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 600.0));
  app.add_option("--after", options.after_s, "seconds at the start that are not scored")
      ->capture_default_str();
  app.add_flag("--no-graph", options.no_graph, "each robot's own filters only");
  app.add_flag("--paper", options.paper, "profile paper instead of the configured one");
  std::vector<std::pair<std::string, crepes::TeamMethod>> methods;
  for (const auto& [name, method] : crepes::kTeamMethods) methods.emplace_back(name, method);
  app.add_option("--method", options.method, "how the team is estimated, instead of as configured")
      ->transform(CLI::CheckedTransformer(methods));
  app.add_flag("--scaled", options.scaled, "also the bound with the IMUs' scale and axis errors");
  app.add_flag("--bound-only", options.bound_only, "print the bounds by observer; no replay");
  app.add_option("--leds", options.leds,
                 "render every picture, with boards of so many LEDs, instead of projecting spots")
      ->check(CLI::Range(1, 64));
  app.add_option("--ring-radius", options.ring_radius_m, "with --leds: radius of the boards [m]")
      ->capture_default_str()
      ->check(CLI::Range(0.005, 1.0));
  app.add_flag("--measured", options.measured,
               "with --leds: the robots know the radius within 2 %, and so measure distances");
  app.add_option("--uwb-noise", options.uwb_noise_m,
                 "uwb.noise_m of all robots, instead of as configured");
  app.add_option("--uwb-bias", options.uwb_bias_m,
                 "uwb.bias_sigma_m of all robots, instead of as configured");
  app.add_option("--liar", options.liar,
                 "make the last robot faulty; errors of the others with it over without it")
      ->check(CLI::IsMember(liars));
  app.add_option("--write", options.write_dir,
                 "also leave every simulated swarm as a data set, DIR/<scenario>-<seed>");
  CLI11_PARSE(app, argc, argv);
  return crepes::study::run(options);
}
