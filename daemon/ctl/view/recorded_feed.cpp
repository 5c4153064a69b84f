#include "daemon/ctl/view/recorded_feed.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/dataset/replay_pairs.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "daemon/ctl/view/field_of_view.hpp"
#include "daemon/ctl/view/view_json.hpp"
#include "net/subscription/json_parts.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr double kRowPeriod_s = 0.04;     // what an eye needs
constexpr double kTruthPeriod_s = 0.025;  // interpolated between
constexpr std::size_t kMaxRows = 20000;   // of a pair; a longer replay is thinned further
constexpr std::size_t kMaxRecords = 4000;

/// What the observer saw of one neighbor.
struct Seen {
  std::string neighbor;
  PairFiles files;
};

std::string joined(const std::vector<std::string>& rows) {
  std::string text = "[";
  for (const std::string& row : rows) text += (text.size() > 1 ? "," : "") + row;
  return text + "]";
}

/// The time between two rows of which one is kept.
Duration row_period(const std::vector<NeighborPose>& poses) {
  if (poses.empty()) return {};
  const double span_s = to_seconds(poses.back().stamp - poses.front().stamp);
  return from_seconds(std::max(kRowPeriod_s, span_s / static_cast<double>(kMaxRows)));
}

template <class Seconds>
std::string rows_of(const std::vector<NeighborPose>& poses, const Seconds& seconds) {
  // Half a row early, because stamps are not exactly periodic.
  const Duration period = row_period(poses) - from_seconds(0.01);
  std::vector<std::string> rows;
  std::optional<Timestamp> last;
  for (const NeighborPose& pose : poses) {
    if (last && pose.stamp - *last < period) continue;
    last = pose.stamp;
    if (std::string row = pose_row(seconds(pose.stamp), pose); !row.empty())
      rows.push_back(std::move(row));
  }
  return joined(rows);
}

/// Every so many of the records that at most kMaxRecords remain.
template <class Record, class Row>
std::string record_rows(const std::vector<Record>& records, const Row& row) {
  const std::size_t stride = records.size() / kMaxRecords + 1;
  std::vector<std::string> rows;
  for (std::size_t i = 0; i < records.size(); i += stride)
    if (std::string text = row(records[i]); !text.empty()) rows.push_back(std::move(text));
  return joined(rows);
}

std::string innovation_row(double t_s, const MeasurementRecord& record) {
  const Fusion& fusion = record.fusion;
  const double nis = fusion.nis / static_cast<double>(fusion.dimension);
  std::string text = fmt::format("[{:.3f},{},{},{}", t_s, static_cast<int>(record.kind),
                                 static_cast<int>(fusion.verdict),
                                 std::isfinite(nis) ? fmt::format("{:.3g}", nis) : "null");
  for (std::size_t i = 0; i < reading_size(record.kind); ++i) {
    if (!std::isfinite(record.reading.at(i))) return {};
    text += fmt::format(",{:.4f}", record.reading.at(i));
  }
  return text + "]";
}

/// Seconds and gated measurements a second, one row a second.
template <class Seconds>
std::string gated_rows(const std::vector<MeasurementRecord>& records, const Seconds& seconds) {
  std::map<std::int64_t, int> gated;  // by whole second
  for (const MeasurementRecord& record : records) {
    gated[std::llround(std::floor(seconds(record.stamp)))] +=
        record.fusion.verdict == Verdict::kGated ? 1 : 0;
  }
  std::vector<std::string> rows;
  rows.reserve(gated.size());
  for (const auto& [second, count] : gated) rows.push_back(fmt::format("[{},{}]", second, count));
  return joined(rows);
}

/// The ages that the daemon would have said: since the newest measurement that was used.
void fill_in_ages(PairFiles& files) {
  auto record = files.measurements.begin();
  std::optional<Timestamp> newest;
  for (NeighborPose& pose : files.poses) {
    for (; record != files.measurements.end() && record->stamp <= pose.stamp; ++record)
      if (record->fusion.verdict == Verdict::kFused) newest = record->stamp;
    if (newest) pose.age_s = to_seconds(pose.stamp - *newest);
  }
}

std::string calibration_row(double t_s, const CalibrationRecord& record) {
  std::string text = fmt::format("[{:.3f}", t_s);
  for (const double value : record.value) {
    if (!std::isfinite(value)) return {};
    text += fmt::format(",{:.4g}", value);
  }
  return text + "]";
}

/// Calls `row` at each instant of the recording; what is not empty is a row.
template <class Row>
std::string truth_rows(double duration_s, const Row& row) {
  const double period_s = std::max(kTruthPeriod_s, duration_s / static_cast<double>(kMaxRows));
  std::vector<std::string> rows;
  for (int i = 0; i * period_s <= duration_s; ++i)
    if (std::string text = row(i * period_s); !text.empty()) rows.push_back(std::move(text));
  return joined(rows);
}

std::string cameras_of(const Config& config) {
  std::vector<std::string> fields;
  for (const CameraConfig& camera : config.cameras)
    fields.push_back(field_of_view_json(camera.calibration));
  return joined(fields);
}

/// `led` and `uwb` of a robot; zero where its place is not known.
std::string mounting_json(const Config* config, RobotId robot) {
  MemberConfig member;
  if (config != nullptr) {
    const auto found = std::ranges::find(config->swarm.members, robot, &MemberConfig::id);
    if (found != config->swarm.members.end()) member = *found;
  }
  return fmt::format(R"({{"led":{},"uwb":{}}})", vector_row(member.p_body_led),
                     vector_row(member.p_body_uwb));
}

Result<std::map<std::string, Config>> configs_of(const fs::path& swarm,
                                                 const SwarmManifest& manifest) {
  std::map<std::string, Config> configs;
  for (const SwarmRobot& robot : manifest.robots) {
    auto config = load_config(swarm / robot.dir / "crepesd.yaml");
    if (!config) return tl::unexpected(config.error());
    configs[robot.name] = std::move(*config);
  }
  return configs;
}

}  // namespace

Result<RecordedFeed> RecordedFeed::open(const fs::path& results, const fs::path& swarm) {
  RecordedFeed feed;
  feed.results_ = results;
  feed.pairs_ = pairs_in(results);
  std::error_code status;
  if (fs::exists(results / "swarm.yaml", status)) {
    return fail(ErrorCode::kNotFound,
                fmt::format("{0}: a recording; replay it first: crepesctl replay {0} --out DIR",
                            results.string()));
  }
  if (feed.pairs_.empty()) return tl::unexpected(no_pairs_in(results));
  for (const PairName& pair : feed.pairs_) {
    if (feed.observers_.empty() || feed.observers_.back() != pair.observer)
      feed.observers_.push_back(pair.observer);
  }
  if (swarm.empty()) return feed;
  auto manifest = load_manifest(swarm);
  if (!manifest) return tl::unexpected(manifest.error());
  if (auto same = check_same_recording(results, *manifest); !same)
    return tl::unexpected(same.error());
  auto truth = SwarmTruth::load(swarm, *manifest);
  if (!truth) return tl::unexpected(truth.error());
  auto configs = configs_of(swarm, *manifest);
  if (!configs) return tl::unexpected(configs.error());
  feed.recording_ = Recording{std::move(*manifest), std::move(*truth), std::move(*configs)};
  for (const PairName& pair : feed.pairs_) {
    for (const std::string& name : {pair.observer, pair.neighbor}) {
      if (feed.robot_named(name) != nullptr) continue;
      return fail(ErrorCode::kNotFound,
                  fmt::format("{}: no robot '{}', of which there are results in {}", swarm.string(),
                              name, results.string()));
    }
  }
  return feed;
}

const SwarmRobot* RecordedFeed::robot_named(const std::string& name) const {
  if (!recording_) return nullptr;
  const auto found = std::ranges::find(recording_->manifest.robots, name, &SwarmRobot::name);
  return found == recording_->manifest.robots.end() ? nullptr : &*found;
}

Result<std::string> RecordedFeed::json_of(const std::string& observer) const {
  std::vector<Seen> neighbors;
  for (const PairName& pair : pairs_) {
    if (pair.observer != observer) continue;
    auto files = read_pair(results_, pair);
    if (!files) return tl::unexpected(files.error());
    std::ranges::stable_sort(files->measurements, {}, &MeasurementRecord::stamp);
    fill_in_ages(*files);
    neighbors.push_back({pair.neighbor, std::move(*files)});
  }
  Timestamp start = Timestamp::max();
  for (const Seen& seen : neighbors)
    if (!seen.files.poses.empty()) start = std::min(start, seen.files.poses.front().stamp);
  const SwarmRobot* const B = robot_named(observer);
  const auto seconds = [&](Timestamp t) {
    return B != nullptr ? B->clock.true_s(t) : to_seconds(t - start);
  };
  const Config* const config = B != nullptr ? &recording_->configs.at(B->name) : nullptr;
  const double duration_s = recording_ ? recording_->manifest.duration_s : -1.0;
  const std::string up = truth_rows(duration_s, [&](double t) -> std::string {
    const auto T_W_B = recording_->truth.pose(B->id, t);
    if (!T_W_B) return {};
    const Eigen::Vector3d up_B = T_W_B->q.conjugate() * Eigen::Vector3d::UnitZ();
    return fmt::format("[{:.3f},{}", t, vector_row(up_B).substr(1));
  });
  std::vector<std::string> parts;
  for (const auto& [name, files] : neighbors) {
    const SwarmRobot* const N = robot_named(name);
    const std::string truth = truth_rows(duration_s, [&](double t) -> std::string {
      const auto T_B_N = recording_->truth.relative(B->id, N->id, B->clock.local(t));
      return T_B_N ? truth_row(t, *T_B_N) : std::string();
    });
    const std::string innovations =
        record_rows(files.measurements, [&](const MeasurementRecord& record) {
          return innovation_row(seconds(record.stamp), record);
        });
    const std::string calibrations =
        record_rows(files.calibrations, [&](const CalibrationRecord& record) {
          return calibration_row(seconds(record.stamp), record);
        });
    parts.push_back(fmt::format(
        R"({{"name":{},"mounting":{},"rows":{},"truth":{},"innovations":{},"calibrations":{},)"
        R"("gated":{}}})",
        dump(OrderedJson(name)), mounting_json(config, N != nullptr ? N->id : RobotId{}),
        rows_of(files.poses, seconds), truth, innovations, calibrations,
        gated_rows(files.measurements, seconds)));
  }
  return fmt::format(R"({{"has_truth":{},"up":{},"mounting":{},"cameras":{},"neighbors":{}}})",
                     recording_.has_value(), up,
                     mounting_json(config, B != nullptr ? B->id : RobotId{}),
                     config != nullptr ? cameras_of(*config) : "[]", joined(parts));
}

}  // namespace crepes
