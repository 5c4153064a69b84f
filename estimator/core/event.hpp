/// The inputs of the estimator.
#pragma once

#include <variant>

#include "estimator/core/measurements.hpp"
#include "estimator/core/team_solution.hpp"

namespace crepes {

/// Time has passed. Timeouts and outputs depend on it, so they replay like any measurement.
struct Tick {
  Timestamp stamp{};
};

/// In order of arrival. A sensor's stamp may lie before the last Tick: data come late.
using Event =
    std::variant<ImuSample, UwbRange, SpotFrame, ReceivedReport, GraphSolution, TeamSolution, Tick>;

/// When it was measured, or for a report when its sender composed it.
[[nodiscard]] inline Timestamp stamp_of(const Event& event) {
  struct Visitor {
    Timestamp operator()(const ReceivedReport& e) const { return e.report.stamp; }
    Timestamp operator()(const ImuSample& e) const { return e.stamp; }
    Timestamp operator()(const UwbRange& e) const { return e.stamp; }
    Timestamp operator()(const SpotFrame& e) const { return e.stamp; }
    Timestamp operator()(const GraphSolution& e) const { return e.stamp; }
    Timestamp operator()(const TeamSolution& e) const { return e.stamp; }
    Timestamp operator()(const Tick& e) const { return e.stamp; }
  };
  return std::visit(Visitor{}, event);
}

}  // namespace crepes
