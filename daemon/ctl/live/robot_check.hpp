/// What is right and wrong with a running robot, in the order in which one thing rests on another.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/live/daemon_access.hpp"

namespace crepes {

/// The result of a check, from good to bad.
enum class CheckVerdict : std::uint8_t {
  kGood,
  kDoubt,  ///< works, and could be better; or is not known
  kFault,  ///< keeps a robot from being located, or a pose from being right
};

[[nodiscard]] std::string_view name_of(CheckVerdict verdict);

/// One result of a check.
struct CheckFinding {
  std::string about;  ///< sensors, rates, clocks, exposure, board, mesh, calibration
  CheckVerdict verdict = CheckVerdict::kGood;
  std::string text;
  std::string advice;  ///< what to do; empty if all is good
};

/// A robot, watched for a few seconds.
struct RobotObservation {
  client::Status before;
  client::Status after;
  double duration_s = 0.0;                ///< between the two
  std::map<RobotId, client::Pose> poses;  ///< the newest of each neighbor
  std::optional<Config> config;           ///< for rates that it should have
};

/// All findings, section by section. Totals count only as far as they grew between the two states,
/// so that what is mended is forgotten. Pure.
[[nodiscard]] std::vector<CheckFinding> check_robot(const RobotObservation& seen);

/// The section about exposure alone.
[[nodiscard]] std::vector<CheckFinding> check_exposure(const client::Status& status);

/// Where the neighbors are, in words that somebody beside the robots can compare. Empty without
/// poses.
[[nodiscard]] std::string places_text(const std::map<RobotId, client::Pose>& poses);

}  // namespace crepes
