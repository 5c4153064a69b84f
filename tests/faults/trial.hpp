/// Swarms with faults against the same swarm without, and what must hold nevertheless.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/faults/fault.hpp"
#include "tests/faults/flight.hpp"
#include "tests/faults/promise.hpp"

namespace crepes::faults {

inline constexpr double kRecovery_s = 2.0;  ///< after the last fault
inline constexpr double kJudged_s = 3.0;    ///< after the recovery
/// Faults of seconds; and of up to half a minute.
inline constexpr FaultTimes kShort{
    .from_s = 5.0, .to_s = 9.0, .longest_s = 4.0, .longest_without_sight_s = 4.0};
inline constexpr FaultTimes kLong{
    .from_s = 5.0, .to_s = 40.0, .longest_s = 30.0, .longest_without_sight_s = 180.0};

/// A simulated swarm. Many trials share one: to simulate and to fly it without faults takes longer
/// than a trial.
struct World {
  std::string scenario;
  int seed = 0;
  bool sealed = false;  ///< its datagrams are sealed and signed

  [[nodiscard]] bool operator==(const World&) const = default;
};
inline constexpr std::uint64_t kSeedsPerWorld = 20;
/// `scenario`: of the studies; empty for `four`, `occluded` and `cluttered` in turn.
[[nodiscard]] World world_of(std::uint64_t seed, const std::string& scenario = {});
[[nodiscard]] std::string to_string(const World& world);
[[nodiscard]] int robots_of(const World& world);

/// A schedule in a world.
struct Trial {
  World world;
  std::vector<Fault> faults;
};
[[nodiscard]] Trial trial_of(std::uint64_t seed, const FaultTimes& times,
                             const std::string& scenario = {});
/// "four 7 sealed: loss r2 5.10 7.25 0.60 123; freeze r1 ...". What follows a # is a comment.
[[nodiscard]] std::string to_string(const Trial& trial);
[[nodiscard]] std::optional<Trial> parse_trial(const std::string& line);

struct Verdict {
  Trial trial;
  std::vector<Fault> smallest;    ///< part of the schedule that still breaks a promise
  std::vector<Broken> broken;     ///< empty if all holds
  double worst_m = 0.0;           ///< error while faults last, of pairs without a fault
  double beyond_s = 0.0;          ///< the longest that one of these was off by more than 5 sigma
  double recovery_s = 0.0;        ///< after the last fault, of all pairs
  std::uint64_t heap_growth = 0;  ///< of the whole swarm [bytes]
  std::uint64_t hash = 0;         ///< of all poses
};

/// Whether a promise was not kept.
[[nodiscard]] inline bool is_broken(const Verdict& verdict) { return !verdict.broken.empty(); }

/// Trials of one world, which is simulated once. They are flown in the order of their first faults:
/// each in a copy of the process that branches off the flight without faults. Schedules of which
/// `is_to_shrink` are reduced.
void try_all(const std::vector<Trial>& trials,
             const std::function<void(const Verdict&)>& on_verdict,
             const std::function<bool(const Verdict&)>& is_to_shrink = is_broken);

/// The poses of a swarm with these faults, or without any, as long as they would be judged.
[[nodiscard]] Traces traces_of(const Trial& trial, bool with_faults);

/// When the swarm must have recovered from the faults.
[[nodiscard]] double recovered_s(const std::vector<Fault>& faults);
/// What of a flight with faults was not as promised. `reference`: without faults.
[[nodiscard]] std::vector<Broken> broken_promises(const std::vector<Fault>& faults,
                                                  const Traces& traces, const Traces& reference);

}  // namespace crepes::faults
