#include "daemon/ctl/replay/replay_output.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "drivers/dataset/pose_file.hpp"
#include "drivers/dataset/record_file.hpp"
#include "drivers/dataset/team_record_file.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr Duration kCalibrationPeriod = std::chrono::milliseconds(100);

/// Whether a replay wrote this file of poses, or began to.
bool is_pose_file(const fs::path& file) {
  std::error_code status;
  if (!fs::is_regular_file(file, status)) return false;
  std::ifstream in(file);
  std::string header;
  return std::getline(in, header) && header == pose_file_header();
}

/// The files of a pair or of the team, whole and begun.
void remove_results(const fs::path& stem) {
  std::error_code status;
  for (const char* extension : {".csv", ".tum", ".innovations.csv", ".calibration.csv"}) {
    fs::path file = stem;
    fs::remove(file += extension, status);
    fs::remove(file += ".part", status);
  }
}

/// The pairs of an earlier replay in an observer's directory: those with a file of poses.
std::set<fs::path> stems_in(const fs::path& observer) {
  std::set<fs::path> stems;
  std::error_code status;
  for (const auto& entry : fs::directory_iterator(observer, status)) {
    fs::path name = entry.path().filename();
    if (name.extension() == ".part") name = name.stem();
    if (name.extension() == ".csv" && is_pose_file(entry.path()))
      stems.insert(observer / name.stem());
  }
  return stems;
}

/// Everything else in `dir` stays. A directory that is empty then goes, too.
void remove_earlier_replay(const fs::path& dir) {
  std::error_code status;
  fs::remove(dir / "report.json", status);  // the mark of a complete result is removed first
  std::vector<fs::path> observers;
  for (const auto& entry : fs::directory_iterator(dir, status))
    if (entry.is_directory(status) && !entry.is_symlink(status)) observers.push_back(entry.path());
  for (const fs::path& observer : observers) {
    const std::set<fs::path> stems = stems_in(observer);
    if (stems.empty()) continue;
    for (const fs::path& stem : stems) remove_results(stem);
    remove_results(observer / kTeamStem);
    fs::remove(observer, status);  // only if it is empty
  }
}

}  // namespace

Result<ReplayOutput> ReplayOutput::create(const fs::path& dir, Names names, Detail detail) {
  std::error_code status;
  if (fs::exists(dir / "swarm.yaml", status) || fs::exists(dir / "crepesd.yaml", status)) {
    return fail(ErrorCode::kConfig, dir.string() +
                                        ": has a data set; the results of a replay need a "
                                        "directory of their own");
  }
  if (detail == Detail::kRecords &&
      std::ranges::any_of(names, [](const auto& entry) { return entry.second == kTeamStem; }))
    return fail(ErrorCode::kConfig, "a robot named 'team' has the same files as the team");
  ReplayOutput output(dir, std::move(names));
  remove_earlier_replay(dir);
  for (const auto& [observer, observer_name] : output.names_) {
    fs::create_directories(dir / observer_name, status);
    if (status) {
      return fail(ErrorCode::kIo,
                  fmt::format("{}: {}", (dir / observer_name).string(), status.message()));
    }
    for (const auto& [neighbor, neighbor_name] : output.names_) {
      if (neighbor == observer) continue;
      auto files = create_pair(dir / observer_name / neighbor_name, detail);
      if (!files) return tl::unexpected(files.error());
      output.pairs_.emplace(std::pair(observer, neighbor), std::move(*files));
    }
    if (detail == Detail::kPoses) continue;
    auto files = create_team(dir / observer_name / kTeamStem);
    if (!files) return tl::unexpected(files.error());
    output.teams_.emplace(observer, std::move(*files));
  }
  return output;
}

Result<ReplayOutput::PairFiles> ReplayOutput::create_pair(const fs::path& stem, Detail detail) {
  remove_results(stem);
  const auto create = [&stem](const char* extension, const std::string& header) {
    fs::path file = stem;
    return PartFile::create(file += extension, header);
  };
  auto csv = create(".csv", std::string(pose_file_header()) + '\n');
  if (!csv) return tl::unexpected(csv.error());
  auto tum = create(".tum", "");
  if (!tum) return tl::unexpected(tum.error());
  PairFiles files{.csv = std::move(*csv), .tum = std::move(*tum), .records = {}};
  if (detail == Detail::kPoses) return files;
  auto innovations = create(".innovations.csv", innovation_file_header() + '\n');
  if (!innovations) return tl::unexpected(innovations.error());
  auto calibration = create(".calibration.csv", calibration_file_header() + '\n');
  if (!calibration) return tl::unexpected(calibration.error());
  files.records = RecordFiles{.innovations = std::move(*innovations),
                              .calibration = std::move(*calibration),
                              .last_calibration = {}};
  return files;
}

Result<ReplayOutput::TeamFiles> ReplayOutput::create_team(const fs::path& stem) {
  auto innovations =
      PartFile::create(fs::path(stem) += ".innovations.csv", team_innovation_file_header() + '\n');
  if (!innovations) return tl::unexpected(innovations.error());
  auto calibration =
      PartFile::create(fs::path(stem) += ".calibration.csv", team_calibration_file_header() + '\n');
  if (!calibration) return tl::unexpected(calibration.error());
  return TeamFiles{.innovations = std::move(*innovations), .calibration = std::move(*calibration)};
}

ReplayOutput::PairFiles& ReplayOutput::files_of(RobotId observer, RobotId neighbor) {
  const auto pair = pairs_.find({observer, neighbor});
  CREPES_EXPECT(pair != pairs_.end(), "results of a robot that is not in the data set");
  return pair->second;
}

void ReplayOutput::write(RobotId observer, const NeighborPose& pose) {
  CREPES_EXPECT(pose.T_B_N.pose.p.allFinite() && pose.T_B_N.pose.q.coeffs().allFinite() &&
                    pose.T_B_N.covariance.allFinite(),
                "a pose that is not finite");
  PairFiles& files = files_of(observer, pose.neighbor);
  append_pose_row(files.csv.text(), pose);
  files.csv.flush_if_large();
  append_tum_row(files.tum.text(), pose);
  files.tum.flush_if_large();
}

void ReplayOutput::write(RobotId observer, const Records& records) {
  // Members that were not recorded are measured, too.
  const auto is_recorded = [&](const auto& record) { return names_.contains(record.neighbor); };
  for (const MeasurementRecord& record : records.measurements) {
    if (!is_recorded(record)) continue;
    auto& files = files_of(observer, record.neighbor).records;
    CREPES_EXPECT(files.has_value(), "records for an output that takes poses only");
    append_innovation_row(files->innovations.text(), record);
    files->innovations.flush_if_large();
  }
  for (const CalibrationRecord& record : records.calibrations) {
    if (!is_recorded(record)) continue;
    auto& files = files_of(observer, record.neighbor).records;
    CREPES_EXPECT(files.has_value(), "records for an output that takes poses only");
    if (files->last_calibration && record.stamp - *files->last_calibration < kCalibrationPeriod)
      continue;
    files->last_calibration = record.stamp;
    append_calibration_row(files->calibration.text(), record);
    files->calibration.flush_if_large();
  }
  for (const TeamRecord& record : records.team) {
    const auto files = teams_.find(observer);
    CREPES_EXPECT(files != teams_.end(), "records for an output that takes poses only");
    auto& [innovations, calibration] = files->second;
    append_team_innovation_rows(innovations.text(), record, names_);
    innovations.flush_if_large();
    append_team_calibration_rows(calibration.text(), record, names_);
    calibration.flush_if_large();
  }
}

Result<void> ReplayOutput::finish(const ReplayReport& report) {
  for (auto& [pair, files] : pairs_) {
    if (auto done = files.csv.publish(); !done) return done;
    if (auto done = files.tum.publish(); !done) return done;
    if (!files.records) continue;
    if (auto done = files.records->innovations.publish(); !done) return done;
    if (auto done = files.records->calibration.publish(); !done) return done;
  }
  for (auto& [observer, files] : teams_) {
    if (auto done = files.innovations.publish(); !done) return done;
    if (auto done = files.calibration.publish(); !done) return done;
  }
  auto file = PartFile::create(dir_ / "report.json", report_json(report, names_));
  if (!file) return tl::unexpected(file.error());
  return file->publish();
}

}  // namespace crepes
