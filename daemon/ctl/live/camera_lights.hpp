/// The cameras' exposure and gain, and the threshold, in the files of a configuration.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera_light.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Exposure and gain of the camera of this name.
struct NamedLight {
  std::string camera;
  CameraLight light;
};

class CameraLights {
 public:
  /// Those in force in `config`, with its fragments. `camera` names the one to change; empty: the
  /// first.
  [[nodiscard]] static Result<CameraLights> load(const std::filesystem::path& config,
                                                 const std::string& camera);

  /// The robot that the configuration is of.
  [[nodiscard]] RobotId robot() const { return robot_; }
  [[nodiscard]] const std::vector<NamedLight>& all() const { return lights_; }
  /// Of the camera to change.
  [[nodiscard]] const CameraLight& light() const { return lights_[chosen_].light; }

  /// Changes what `light` has (fragment 90-exposure.yaml), and vision.threshold [grey levels; 0:
  /// automatic] (fragment 90-threshold.yaml). All of it or nothing: with a fault in the result, the
  /// fragments are as before and the fault is returned.
  [[nodiscard]] Result<void> change(const CameraLight& light, std::optional<int> threshold = {});

 private:
  CameraLights(std::filesystem::path config, RobotId robot, std::vector<NamedLight> lights,
               std::size_t chosen)
      : config_(std::move(config)), robot_(robot), lights_(std::move(lights)), chosen_(chosen) {}

  std::filesystem::path config_;
  RobotId robot_;
  std::vector<NamedLight> lights_;
  std::size_t chosen_;
};

}  // namespace crepes
