/// The whole of a robot's estimation behind one function.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/event.hpp"
#include "estimator/core/outputs.hpp"

namespace crepes {

/// What a step gave. Most steps give nothing; a Tick may give everything.
struct Outputs {
  std::vector<NeighborPose> poses;            ///< to publish, ordered by neighbor
  std::optional<Report> report;               ///< to broadcast
  std::optional<GraphProblem> graph_problem;  ///< to solve; the answer comes back as an Event
  std::vector<Bearing> bearings;              ///< what the cameras identified
  Records records;                            ///< at a Tick, if they are kept
};

/// Events in order of arrival in, poses out. A pure function of the events so far: same events,
/// same outputs, to the bit. Late data are put in their place within `estimator.lag_ms`.
class Estimator {
 public:
  /// `config` must have passed validation.
  explicit Estimator(const Config& config);
  Estimator(Estimator&&) noexcept;
  Estimator& operator=(Estimator&&) noexcept;
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;
  ~Estimator();

  [[nodiscard]] Outputs step(const Event& event);
  /// Other settings from now on, with the same `robot` and `cameras`. Filters keep what they know,
  /// unless the profile or a mounting changes. New members are unknown, missing ones forgotten.
  /// Where `vision` or a code changes, tracks begin anew and read their IDs again.
  void reconfigure(const Config& config);
  /// From now on `Outputs::records` tells of every measurement. Changes nothing else.
  void keep_records();
  [[nodiscard]] EstimatorStatus status() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace crepes
