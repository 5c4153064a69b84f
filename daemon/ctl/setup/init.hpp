/// crepesctl init: the configuration of a new robot, from what is connected and a few answers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/setup/devices.hpp"
#include "daemon/ctl/setup/questions.hpp"
#include "daemon/ctl/setup/robot_plan.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// What is given is not asked.
struct InitOptions {
  std::filesystem::path dir = "/etc/crepes";
  std::optional<int> id;
  std::optional<std::size_t> robots;
  std::optional<std::string> camera_driver;
  std::optional<std::string> camera_device;
  std::optional<std::vector<int>> resolution;  ///< width, height
  std::optional<double> rate_hz;
  std::optional<double> fov_deg;
  std::optional<std::string> look;
  std::optional<std::string> imu_port;
  std::optional<std::string> uwb_port;
  std::optional<std::vector<double>> p_body_led;  ///< of every robot that is new in swarm.yaml
  std::optional<std::vector<double>> p_body_uwb;
  std::optional<std::string> interface;
  bool force = false;          ///< replaces files; the old ones get a name with ~
  bool search_devices = true;  ///< else only what is given
  DevicesOptions devices{};
  bool json = false;
};

/// What was written, and what remains to be done.
struct InitReport {
  std::string text;                   ///< for standard output
  std::vector<ConfigFault> faults;    ///< of the result, as --check-config finds them
  std::vector<ConfigFault> warnings;  ///< what is still to do
};

/// Writes crepesd.yaml, crepesd.d/10-devices.yaml, swarm.yaml and camchain-imucam.yaml, and checks
/// them. A swarm.yaml that exists is kept, unless `robots` is given: it is shared by all robots.
/// Writes nothing if one of its files exists and `force` is not set; the error names them all.
[[nodiscard]] Result<InitReport> init(const InitOptions& options, Questions& questions);

}  // namespace crepes
