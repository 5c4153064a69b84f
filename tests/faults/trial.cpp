#include "tests/faults/trial.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <numbers>
#include <sstream>

#include "estimator/core/contract.hpp"
#include "tests/faults/in_child.hpp"
#include "tests/faults/shrink.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes::faults {
namespace {

constexpr std::array<std::string_view, 3> kScenarioNames{"four", "occluded", "cluttered"};
constexpr double kLongestBeyond_s = 0.5;
constexpr double kLongestAbsence_s = 0.5;
constexpr double kPosePeriod_s = 0.02;
constexpr double kMostFewer_s = 0.8;  // poses than without faults, of 3 s
constexpr double kGone_s = 2.0;
constexpr double kDegrees = 180.0 / std::numbers::pi;  // a radian

double first_s(const std::vector<Fault>& faults) {
  return std::ranges::min_element(faults, {}, &Fault::from_s)->from_s;
}

constexpr double kMargin_s = 0.5;   ///< of the simulation, beyond what is flown
constexpr double kBefore_s = 1e-3;  ///< the first fault, when they are announced

double end_s(const std::vector<Fault>& faults) { return recovered_s(faults) + kJudged_s; }

bool is_of(const Fault& fault, const Pair& pair) {
  return fault.robot == pair.first || fault.robot == pair.second;
}

/// Whether a fault makes this pair's poses wrong: one of the two is faulty.
bool is_excused(const std::vector<Fault>& faults, const Pair& pair) {
  return std::ranges::any_of(faults, [&](const Fault& fault) {
    return about(fault.kind).scope == Scope::kRobot && is_of(fault, pair);
  });
}

/// Killed for good: nobody sees it again.
bool is_lost(const std::vector<Fault>& faults, const Pair& pair) {
  return std::ranges::any_of(faults, [&](const Fault& fault) {
    return fault.kind == Kind::kKilled && is_of(fault, pair);
  });
}

/// Learned calibration may have to be learned anew.
double allowed_rmse_m(double reference_m) { return 2.0 * reference_m + 0.03; }
double allowed_rmse_rad(double reference_rad) { return 2.0 * reference_rad + 0.02; }

/// Poses of a robot that is switched off or frozen: while they are published, they are honest.
bool is_ghost(const std::vector<Fault>& faults, RobotId robot, const PoseError& pose) {
  return !(pose.mahalanobis2 <= kBeyond5Sigma) &&
         std::ranges::any_of(faults, [&](const Fault& fault) {
           const bool is_killed = fault.kind == Kind::kKilled;
           const bool is_gone =
               is_killed || fault.kind == Kind::kReboot || fault.kind == Kind::kFreeze;
           return is_gone && fault.robot == robot && pose.true_s > fault.from_s + kGone_s &&
                  (is_killed || pose.true_s < fault.to_s);
         });
}

class PairJudge {
 public:
  PairJudge(const std::vector<Fault>& faults, const Pair& pair, const PoseTrace& found,
            const PoseTrace& reference)
      : faults_(faults),
        pair_(pair),
        found_(found),
        reference_(reference),
        all_{first_s(faults), end_s(faults)},
        after_{recovered_s(faults), end_s(faults)} {}

  [[nodiscard]] std::vector<Broken> broken() {
    if (const auto count = found_.not_finite(); count > 0)
      add(Promise::kFinite, static_cast<double>(count), fmt::format("{} poses not finite", count));
    if (const auto count = found_.unusable(); count > 0)
      add(Promise::kFinite, static_cast<double>(count),
          fmt::format("{} poses whose covariance is none, or says that they are of no use", count));
    judge_honesty();
    if (reference_.rmse_m(after_) > 0.0 && !is_lost(faults_, pair_)) judge_recovery();
    return std::move(broken_);
  }

 private:
  void judge_honesty() {
    const bool excused = is_excused(faults_, pair_);
    const Beyond beyond = found_.beyond(excused ? after_ : all_);
    if (beyond.longest_s > kLongestBeyond_s)
      add(Promise::kHonest, beyond.longest_s,
          fmt::format("beyond 5 sigma for {:.2f} s, up to {:.2f} m and {:.2f} rad",
                      beyond.longest_s, beyond.worst_m, beyond.worst_rad));
    const auto ghosts = std::ranges::count_if(found_.errors(), [&](const PoseError& pose) {
      return is_ghost(faults_, pair_.second, pose);
    });
    if (!excused && ghosts > 0)
      add(Promise::kNoGhosts, static_cast<double>(ghosts),
          fmt::format("{} dishonest poses of a robot that is gone", ghosts));
  }

  void judge_recovery() {
    const double absence_s = found_.longest_absence_s(after_);
    const double allowed_s =
        std::max(kLongestAbsence_s, reference_.longest_absence_s(after_) + 0.1);
    if (absence_s > allowed_s)
      add(Promise::kPresent, absence_s,
          fmt::format("no pose for {:.2f} s after the recovery", absence_s));
    const double fewer_s = (reference_.count(after_) - found_.count(after_)) * kPosePeriod_s;
    if (absence_s <= allowed_s && fewer_s > kMostFewer_s)
      add(Promise::kPresent, fewer_s,
          fmt::format("poses of {:.2f} s are missing after the recovery", fewer_s));
    const double without_m = reference_.rmse_m(after_);
    const double rmse_m = found_.rmse_m(after_);
    if (rmse_m > allowed_rmse_m(without_m))
      add(Promise::kError, rmse_m,
          fmt::format("error {:.3f} m after the recovery, {:.3f} m without faults", rmse_m,
                      without_m));
    const double without_rad = reference_.rmse_rad(after_);
    const double rmse_rad = found_.rmse_rad(after_);
    if (rmse_rad > allowed_rmse_rad(without_rad))
      add(Promise::kTurn, rmse_rad * kDegrees,
          fmt::format("turned by {:.2f} deg after the recovery, {:.2f} deg without faults",
                      rmse_rad * kDegrees, without_rad * kDegrees));
  }

  void add(Promise promise, double size, const std::string& what) {
    broken_.push_back({promise, size,
                       fmt::format("r{} -> r{}: {}", pair_.first.value, pair_.second.value, what)});
  }

  const std::vector<Fault>& faults_;
  Pair pair_;
  const PoseTrace& found_;
  const PoseTrace& reference_;
  Span all_;
  Span after_;
  std::vector<Broken> broken_;
};

void measure(const std::vector<Fault>& faults, const Traces& traces, const Traces& reference,
             Verdict& verdict) {
  const double last_s = recovered_s(faults) - kRecovery_s;
  const Span during{first_s(faults), recovered_s(faults)};
  const Span after{last_s, end_s(faults)};
  for (const auto& [pair, trace] : traces) {
    verdict.hash = verdict.hash * 31 + trace.hash();
    if (!is_excused(faults, pair)) {
      verdict.worst_m = std::max(verdict.worst_m, trace.worst_m(during));
      verdict.beyond_s = std::max(verdict.beyond_s, trace.beyond(during).longest_s);
    }
    const double without_m = reference.at(pair).rmse_m(after);
    if (without_m == 0.0 || is_lost(faults, pair)) continue;
    const double recovered_s = trace.recovered_at_s(after, allowed_rmse_m(without_m));
    verdict.recovery_s = std::max(verdict.recovery_s, recovered_s - last_s);
  }
}

/// What a copy of the process reports.
std::string to_text(const Verdict& verdict) {
  std::string text = fmt::format("{} {} {} {} {}\n", verdict.worst_m, verdict.beyond_s,
                                 verdict.recovery_s, verdict.heap_growth, verdict.hash);
  for (const Broken& one : verdict.broken)
    text += fmt::format("{} {} {}\n", name_of(one.promise), one.size, one.text);
  return text;
}

/// Streams read neither infinities nor what is not a number.
bool read_number(std::istream& text, double& number) {
  std::string word;
  if (!(text >> word)) return false;
  char* end = nullptr;
  number = std::strtod(word.c_str(), &end);
  return end == word.c_str() + word.size();
}

Verdict read_verdict(const ChildResult& child) {
  Verdict verdict;
  std::istringstream text(child.text);
  bool is_read = read_number(text, verdict.worst_m) && read_number(text, verdict.beyond_s) &&
                 read_number(text, verdict.recovery_s) &&
                 (text >> verdict.heap_growth >> verdict.hash);
  Broken one;
  for (std::string name; is_read && text >> name;) {
    is_read = read_number(text, one.size) && std::getline(text >> std::ws, one.text);
    one.promise = promise_of(name).value_or(Promise::kRuns);
    verdict.broken.push_back(one);
  }
  if (!child.crash.empty()) {
    verdict.broken.push_back({Promise::kRuns, 1.0, child.crash});
  } else if (!is_read) {
    verdict.broken.push_back({Promise::kRuns, 1.0, "its verdict cannot be read: " + child.text});
  }
  return verdict;
}

/// A world's flight without faults, off which trials branch.
class Branches {
 public:
  Branches(const study::Swarm& swarm, bool sealed, const Traces& reference)
      : flight_(swarm, sealed), reference_(reference) {}

  [[nodiscard]] Verdict judge(const Trial& trial,
                              const std::function<bool(const Verdict&)>& is_to_shrink) {
    flight_.fly_until(first_s(trial.faults) - kBefore_s);
    Verdict verdict = fly(trial.faults);
    verdict.trial = trial;
    verdict.smallest = trial.faults;
    if (is_to_shrink(verdict)) shrink(verdict);
    return verdict;
  }

 private:
  [[nodiscard]] Verdict fly(const std::vector<Fault>& faults) {
    return read_verdict(in_child([&] {
      Verdict verdict;
      flight_.strike(faults);
      flight_.fly_until(end_s(faults));
      verdict.heap_growth = flight_.heap_growth();
      measure(faults, flight_.traces(), reference_, verdict);
      verdict.broken = broken_promises(faults, flight_.traces(), reference_);
      for (std::string& line : flight_.complaints())
        verdict.broken.push_back({Promise::kProgram, 1.0, std::move(line)});
      return to_text(verdict);
    }));
  }

  /// The smallest schedule that still breaks one of the promises.
  void shrink(Verdict& verdict) {
    const auto is_same = [&](const Broken& one) {
      return std::ranges::any_of(verdict.broken,
                                 [&](const Broken& b) { return b.promise == one.promise; });
    };
    verdict.smallest = shrunk(verdict.smallest, [&](const std::vector<Fault>& faults) {
      return std::ranges::any_of(fly(faults).broken, is_same);
    });
  }

  Flight flight_;
  const Traces& reference_;
};

const study::Scenario& scenario_of(const World& world) {
  const auto* const scenario =
      std::ranges::find(study::kScenarios, world.scenario, &study::Scenario::name);
  CREPES_EXPECT(scenario != study::kScenarios.end(), "a world is of a known scenario");
  return *scenario;
}

study::Swarm simulate(const World& world, double duration_s) {
  return study::simulate_swarm(scenario_of(world), world.seed, duration_s);
}

}  // namespace

World world_of(std::uint64_t seed, const std::string& scenario) {
  const std::uint64_t index = (seed - 1) / kSeedsPerWorld;
  const std::string turn(kScenarioNames.at(index % kScenarioNames.size()));
  return {.scenario = scenario.empty() ? turn : scenario,
          .seed = static_cast<int>(index + 1),
          .sealed = index / kScenarioNames.size() % 2 == 0};
}

int robots_of(const World& world) {
  constexpr int kAtRest = 4;
  const study::Scenario& scenario = scenario_of(world);
  SimConfig sim;
  sim.scenario = scenario.world;
  return scenario.rests ? kAtRest : static_cast<int>(SimWorld(sim).robots().size());
}

std::string to_string(const World& world) {
  return fmt::format("{} {} {}", world.scenario, world.seed, world.sealed ? "sealed" : "open");
}

Trial trial_of(std::uint64_t seed, const FaultTimes& times, const std::string& scenario) {
  World world = world_of(seed, scenario);
  std::vector<Fault> faults = draw_faults(seed, robots_of(world), times);
  return {std::move(world), std::move(faults)};
}

std::string to_string(const Trial& trial) {
  std::string text = to_string(trial.world) + ":";
  for (const Fault& fault : trial.faults)
    text += (text.back() == ':' ? " " : "; ") + to_string(fault);
  return text;
}

std::optional<Trial> parse_trial(const std::string& line) {
  const std::string text = line.substr(0, line.find('#'));
  const auto colon = text.find(':');
  if (colon == std::string::npos) return std::nullopt;
  Trial trial;
  std::string sealed;
  std::istringstream(text.substr(0, colon)) >> trial.world.scenario >> trial.world.seed >> sealed;
  if (std::ranges::find(study::kScenarios, trial.world.scenario, &study::Scenario::name) ==
      study::kScenarios.end())
    return std::nullopt;
  trial.world.sealed = sealed == "sealed";
  std::istringstream faults(text.substr(colon + 1));
  for (std::string one; std::getline(faults, one, ';');) {
    const auto fault = parse_fault(one);
    if (!fault) return std::nullopt;
    trial.faults.push_back(*fault);
  }
  return trial.faults.empty() ? std::nullopt : std::optional(trial);
}

double recovered_s(const std::vector<Fault>& faults) {
  return std::ranges::max_element(faults, {}, &Fault::to_s)->to_s + kRecovery_s;
}

std::vector<Broken> broken_promises(const std::vector<Fault>& faults, const Traces& traces,
                                    const Traces& reference) {
  std::vector<Broken> broken;
  for (const auto& [pair, trace] : traces)
    for (Broken& one : PairJudge(faults, pair, trace, reference.at(pair)).broken())
      broken.push_back(std::move(one));
  return broken;
}

Traces traces_of(const Trial& trial, bool with_faults) {
  const double last_s = end_s(trial.faults);
  const study::Swarm swarm = simulate(trial.world, last_s + kMargin_s);
  Flight flight(swarm, trial.world.sealed);
  flight.fly_until(first_s(trial.faults) - kBefore_s);
  if (with_faults) flight.strike(trial.faults);
  flight.fly_until(last_s);
  return flight.traces();
}

void try_all(const std::vector<Trial>& trials,
             const std::function<void(const Verdict&)>& on_verdict,
             const std::function<bool(const Verdict&)>& is_to_shrink) {
  if (trials.empty()) return;
  const World& world = trials.front().world;
  double last_s = 0.0;
  for (const Trial& trial : trials) last_s = std::max(last_s, end_s(trial.faults));
  const study::Swarm swarm = simulate(world, last_s + kMargin_s);
  Flight healthy(swarm, world.sealed);
  healthy.fly_until(last_s);
  Branches branches(swarm, world.sealed, healthy.traces());
  std::vector<Trial> sorted = trials;
  std::ranges::stable_sort(sorted, {}, [](const Trial& trial) { return first_s(trial.faults); });
  for (const Trial& trial : sorted) {
    CREPES_EXPECT(trial.world == world, "all trials are of one world");
    on_verdict(branches.judge(trial, is_to_shrink));
  }
}

}  // namespace crepes::faults
