/// The boards that a robot's cameras see.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "estimator/core/imu_history.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/swarm/estimator_settings.hpp"
#include "estimator/vision/blink_tracker.hpp"

namespace crepes {

/// What one frame shows.
struct SeenBoards {
  std::vector<Bearing> bearings;   ///< of the identified robots that are lit
  std::vector<Bearing> confirmed;  ///< of earlier frames, see `BlinkTracker::confirmed`
};

/// The tracks of lights of all cameras.
class CameraTracks {
 public:
  /// `settings` must come from a configuration without faults.
  explicit CameraTracks(const EstimatorSettings& settings);

  [[nodiscard]] std::size_t size() const { return cameras_.size(); }
  /// Only bearings of such a camera are measurements: IDs are read through any lens; a direction
  /// through a guessed one would be degrees off.
  [[nodiscard]] bool is_calibrated(std::size_t camera) const {
    return cameras_[camera].is_calibrated;
  }

  /// A sample of the robot's own, in order: between frames the tracks turn with it.
  void add_imu(const ImuSample& sample);
  /// `expected`: the boards of robots with a pose. `imu`: the robot's own.
  [[nodiscard]] SeenBoards step(const SpotFrame& frame, std::span<const ExpectedBoard> expected,
                                const ImuHistory& imu);
  /// The cameras' counts, also of each of the `neighbors` that it has already.
  void write_to(EstimatorStatus& status) const;

 private:
  struct Camera {
    BlinkTracker tracker;
    bool is_calibrated = false;
  };

  std::vector<Camera> cameras_;
  double stamp_sigma_s_ = 0.0;
};

}  // namespace crepes
