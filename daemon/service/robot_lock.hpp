/// One daemon a robot on this machine.
#pragma once

#include <optional>
#include <string>

#include "drivers/base/unique_fd.hpp"
#include "estimator/core/measurements.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// Claims a robot's id on this machine, whatever interfaces its meshes have. A mesh on `lo` reaches
/// no other robot: there, each port is a swarm of its own (simulations and tests). The kernel ends
/// the claim with the process, so nothing is left behind.
class RobotLock {
 public:
  /// kBusy if another process has it.
  [[nodiscard]] static Result<RobotLock> claim(RobotId robot, const std::string& interface,
                                               int port);
  /// The claim of the same robot after a change of its mesh. Empty if it is this one.
  [[nodiscard]] Result<std::optional<RobotLock>> moved_to(const std::string& interface,
                                                          int port) const;

 private:
  RobotLock(RobotId robot, std::string name, UniqueFd socket)
      : robot_(robot), name_(std::move(name)), socket_(std::move(socket)) {}

  RobotId robot_;
  std::string name_;
  UniqueFd socket_;
};

}  // namespace crepes
