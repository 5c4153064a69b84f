/// One measurement of a neighbor, as its filter receives it.
#pragma once

#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "estimator/core/outputs.hpp"
#include "estimator/relative/neighbor_filter.hpp"
#include "estimator/relative/raw_pose.hpp"

namespace crepes {

/// A raw pose and the two bearings it was computed from.
struct MutualInitialization {
  RawPose raw;
  DirectionReading bearing;
  DirectionReading peer_bearing;
};

/// The robot in whose axes a pair's filter works.
enum class FilterAxes { kOurs, kNeighbors };

/// Poses for a track of which only one robot sees the other, in the axes of the one that sees: a
/// pose for every heading that a single bearing allows, or the neighbor's estimate.
struct OneWayInitialization {
  std::vector<GaussianPose> T_seer_seen;
  FilterAxes axes = FilterAxes::kOurs;
  /// Vertical of the robot that is seen, its axes, where the poses are of all headings.
  std::optional<Eigen::Vector3d> up_seen{};
};

/// A measurement that corrects or initializes a neighbor's filter.
struct Measurement {
  Timestamp stamp{};
  MeasurementKind kind = MeasurementKind::kBearing;
  std::variant<DirectionReading, RangeReading, RingReading, MutualInitialization,
               OneWayInitialization, GraphPose>
      reading;
};

/// Whether a module measured it, either robot's.
[[nodiscard]] constexpr bool is_range(MeasurementKind kind) {
  return kind == MeasurementKind::kRange || kind == MeasurementKind::kPeerRange;
}

/// What the sensor read; empty for poses.
[[nodiscard]] SensorReading reading_of(const Measurement& measurement);

/// The measurements at the front of `ordered` with the same kind, stamp and camera. They are
/// alternatives: at most one of them is true. `ordered` must not be empty.
[[nodiscard]] std::span<const Measurement> leading_group(std::span<const Measurement> ordered);

}  // namespace crepes
