/// The results of a replay: a file of poses for every ordered pair, and a report.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/ctl/dataset/swarm_manifest.hpp"
#include "drivers/dataset/dataset_faults.hpp"
#include "drivers/dataset/part_file.hpp"
#include "estimator/core/outputs.hpp"
#include "estimator/core/result.hpp"
#include "net/subscription/system_status.hpp"

namespace crepes {

/// `observer`'s estimate of a peer's clock at an instant of its own clock.
struct ClockSample {
  RobotId observer{};
  Timestamp stamp{};
  ClockStatus clock;
};

/// The report of one robot.
struct RobotReport {
  RobotId robot{};
  EstimatorStatus status;
  /// Bearings with a wrong ID according to truth, by neighbor; empty without truth.
  std::optional<std::map<RobotId, std::uint64_t>> id_mistakes;
  std::uint64_t datagrams_sent = 0;
  std::uint64_t bytes_sent = 0;
  double airtime = 0.0;  ///< share of the channel's time, by the model in send_pacing.hpp
  std::vector<std::pair<std::string, std::uint64_t>> network;  ///< received and refused, by reason
  std::vector<std::pair<std::string, double>> cpu_s;           ///< by stage
};

/// The contents of report.json.
struct ReplayReport {
  std::string scenario;
  std::string profile;
  bool graph = true;
  std::uint64_t seed = 0;
  double duration_s = 0.0;
  std::vector<RobotReport> robots;
  std::vector<ClockSample> clocks;  ///< about one per second and pair
  DatasetFaults faults;
};

/// Writes DIR/<observer>/<neighbor>.csv and .tum during the replay, and DIR/report.json at the end;
/// with records also <neighbor>.innovations.csv and .calibration.csv, and those of the team. Files
/// have their final names only after `finish`. Before, they end in ".part", and the results of an
/// earlier replay are removed, those of robots that are no more among the names, too.
class ReplayOutput {
 public:
  /// The name of each robot's directory.
  using Names = std::map<RobotId, std::string>;
  /// Whether the files of records are written besides those of poses.
  enum class Detail { kPoses, kRecords };

  /// A directory with a data set is refused.
  [[nodiscard]] static Result<ReplayOutput> create(const std::filesystem::path& dir, Names names,
                                                   Detail detail = Detail::kPoses);

  /// `pose.neighbor` must be among the names. `finish` reports write errors.
  void write(RobotId observer, const NeighborPose& pose);
  /// Only with Detail::kRecords. Calibrations are thinned to ten per second.
  void write(RobotId observer, const Records& records);

  [[nodiscard]] Result<void> finish(const ReplayReport& report);

 private:
  struct RecordFiles {
    PartFile innovations;
    PartFile calibration;
    std::optional<Timestamp> last_calibration;
  };
  struct TeamFiles {
    PartFile innovations;
    PartFile calibration;
  };
  struct PairFiles {
    PartFile csv;
    PartFile tum;
    std::optional<RecordFiles> records;
  };

  ReplayOutput(std::filesystem::path dir, Names names)
      : dir_(std::move(dir)), names_(std::move(names)) {}

  [[nodiscard]] static Result<PairFiles> create_pair(const std::filesystem::path& stem,
                                                     Detail detail);
  [[nodiscard]] static Result<TeamFiles> create_team(const std::filesystem::path& stem);
  [[nodiscard]] PairFiles& files_of(RobotId observer, RobotId neighbor);

  std::filesystem::path dir_;
  Names names_;
  std::map<std::pair<RobotId, RobotId>, PairFiles> pairs_;
  std::map<RobotId, TeamFiles> teams_;  ///< by observer; only with records
};

/// report.json's text.
[[nodiscard]] std::string report_json(const ReplayReport& report, const ReplayOutput::Names& names);

/// The clock samples of a report.json, with robots by name as in `names`. Robots that are not in
/// `names` are an error.
[[nodiscard]] Result<std::vector<ClockSample>> read_clock_samples(const std::filesystem::path& file,
                                                                  const ReplayOutput::Names& names);

/// Refuses results whose report.json is of another scenario or duration than `manifest`. What is
/// missing on either side is not compared; the seed is not, as `replay --seed` changes it.
[[nodiscard]] Result<void> check_same_recording(const std::filesystem::path& results,
                                                const SwarmManifest& manifest);

}  // namespace crepes
