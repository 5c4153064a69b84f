/// The whole of a robot's estimation behind one function.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "estimator/core/event.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/swarm/estimator_settings.hpp"
#include "estimator/swarm/team_solver.hpp"

namespace crepes {

/// The result of a step. Most steps return nothing; a Tick may return all of it.
struct Outputs {
  std::vector<NeighborPose> poses;          ///< to publish, ordered by neighbor
  std::optional<Report> report;             ///< to broadcast
  std::optional<TeamProblem> team_problem;  ///< to solve; the answer comes back as an Event
  std::vector<Bearing> bearings;  ///< of the robots that a camera identified, calibrated or not
  Records records;                ///< at a Tick, if they are kept
};

/// Receives events in order of their arrival. Its outputs are a function of the events so far: the
/// same events give the same outputs, to the bit. Late data are reordered within a lag that
/// follows their delays.
class Estimator {
 public:
  /// `settings` must come from a configuration without faults.
  explicit Estimator(const EstimatorSettings& settings);
  Estimator(Estimator&&) noexcept;
  Estimator& operator=(Estimator&&) noexcept;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;
  ~Estimator();

  /// Handles one event, and returns what follows from it.
  [[nodiscard]] Outputs step(const Event& event);
  /// Applies other settings with the same `self` and `cameras`. Filters keep their state, unless
  /// the profile changes, or what is configured of a member; the team's begins anew with other
  /// priors, and with other LEDs, antennas or modules of a member. Members may be added and
  /// removed. If `vision`, a code or a ring changes, all tracks restart and decode their IDs again.
  void reconfigure(const EstimatorSettings& settings);
  /// From now on `Outputs::records` contains every measurement. Changes nothing else.
  void keep_records();
  /// Of our IMU. With `EstimatorStatus::refused_samples` these are all, but for the latest.
  [[nodiscard]] std::uint64_t used_samples() const;
  [[nodiscard]] EstimatorStatus status() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace crepes
