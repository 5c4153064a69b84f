/// What a check of a robot looks at, and what it finds.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "daemon/ctl/live/daemon_access.hpp"
#include "daemon/ctl/live/status.hpp"

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
  std::string about;  ///< configuration, sensors, rates, clocks, exposure, board, mesh, calibration
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
  ConfigState config_state{};             ///< what the daemon has not taken over
};

/// Collects the findings of one section.
class CheckSection {
 public:
  CheckSection(std::string about, std::vector<CheckFinding>& findings);

  void good(std::string text);
  void doubt(std::string text, std::string advice);
  void fault(std::string text, std::string advice);

 private:
  void add(CheckVerdict verdict, std::string text, std::string advice);

  std::string about_;
  std::vector<CheckFinding>& findings_;
};

using StatusTotals = client::Status::Totals;

/// Zero if there is no such total.
[[nodiscard]] std::uint64_t total(const StatusTotals& totals, const std::string& name);
/// By how much a total grew. A daemon that restarted in between counts from zero.
[[nodiscard]] std::uint64_t growth(const StatusTotals& before, const StatusTotals& after,
                                   const std::string& name);
/// For example "missed 3, incomplete 1": what grew.
[[nodiscard]] std::string growth_text(const StatusTotals& before, const StatusTotals& after);

/// Null if there is none of this name.
[[nodiscard]] const client::Status::Sensor* sensor_of(const client::Status& status,
                                                      const std::string& name);
/// By name, or "robot 3".
[[nodiscard]] std::string name_of_neighbor(const client::Status::Neighbor& neighbor);

/// Never heard, or not within the last two seconds.
[[nodiscard]] bool is_silent(const client::Status::Neighbor& neighbor);

/// How many measurements of a kind came, and how many of them were refused as unlikely.
struct MeasurementFlow {
  std::uint64_t all = 0;
  std::uint64_t fused = 0;
  std::uint64_t gated = 0;
};

/// Of `kind`, as STATUS names it, between both states.
[[nodiscard]] MeasurementFlow flow_of(const RobotObservation& seen,
                                      const client::Status::Neighbor& now, const std::string& kind);

}  // namespace crepes
