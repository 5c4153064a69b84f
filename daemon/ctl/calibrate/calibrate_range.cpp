#include "daemon/ctl/calibrate/calibrate_range.hpp"

#include <fmt/core.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <utility>

#include "config/writing/config_writer.hpp"
#include "daemon/ctl/calibrate/tape.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/range/range_calibration.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMembersSuffix = ".members.yaml";

struct SwarmRange {
  double true_s = 0.0;
  RobotPair pair;
  UwbRange range;
};

/// The ranges of all robots on the time line of swarm.yaml, and the time of the first row.
struct SwarmRanges {
  std::vector<SwarmRange> ranges;
  double first_s = std::numeric_limits<double>::infinity();
};

SwarmRanges ranges_of(const SwarmDataset& swarm) {
  SwarmRanges all;
  for (const RobotRecording& robot : swarm.robots) {
    const auto begin = [&](Timestamp stamp) {
      all.first_s = std::min(all.first_s, robot.robot.clock.true_s(stamp));
    };
    if (!robot.imu.empty()) begin(robot.imu.front().stamp);
    for (const CameraRecording& camera : robot.cameras)
      if (!camera.spots.empty()) begin(camera.spots.front().stamp);
    if (!robot.ranges.empty()) begin(robot.ranges.front().stamp);
    const RobotId self = robot.robot.id;
    for (const UwbRange& range : robot.ranges) {
      if (range.neighbor == self) continue;
      all.ranges.push_back({robot.robot.clock.true_s(range.stamp),
                            {std::min(self, range.neighbor), std::max(self, range.neighbor)},
                            range});
    }
  }
  std::ranges::stable_sort(all.ranges, {}, &SwarmRange::true_s);
  return all;
}

/// The heading of a robot that turns, from its gyroscope about the vertical that its accelerometer
/// shows. Its bias is what the gyroscope shows in the first second, before the turn begins.
class Heading {
 public:
  Heading(const RobotRecording& robot, double from_s, double to_s) {
    constexpr double kBefore_s = 1.0;
    const auto true_s = [&](const ImuSample& sample) {
      return robot.robot.clock.true_s(sample.stamp);
    };
    Eigen::Vector3d up = Eigen::Vector3d::Zero();
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    double rests = 0.0;
    for (const ImuSample& sample : robot.imu) {
      const double t_s = true_s(sample);
      if (t_s < from_s || t_s > to_s) continue;
      up += sample.accel_mps2;
      if (t_s > from_s + kBefore_s) continue;
      rest += sample.gyro_radps;
      rests += 1.0;
    }
    up.normalize();
    const Eigen::Vector3d bias = rest / std::max(1.0, rests);
    double heading = 0.0;
    for (const ImuSample& sample : robot.imu) {
      const double t_s = true_s(sample);
      if (t_s < from_s || t_s > to_s) continue;
      if (!times_s_.empty()) heading += up.dot(sample.gyro_radps - bias) * (t_s - times_s_.back());
      times_s_.push_back(t_s);
      headings_rad_.push_back(heading);
    }
  }

  [[nodiscard]] double at(double true_s) const {
    const auto next = std::ranges::lower_bound(times_s_, true_s);
    if (times_s_.empty()) return 0.0;
    const auto i = std::min<std::ptrdiff_t>(next - times_s_.begin(),
                                            static_cast<std::ptrdiff_t>(times_s_.size()) - 1);
    return headings_rad_[static_cast<std::size_t>(i)];
  }

 private:
  std::vector<double> times_s_;
  std::vector<double> headings_rad_;
};

std::optional<Heading> heading_of(const SwarmDataset& swarm, const TapeSegment& segment,
                                  double first_s) {
  const auto robot = std::ranges::find_if(swarm.robots, [&](const RobotRecording& recording) {
    return recording.robot.id == segment.turning;
  });
  if (robot == swarm.robots.end()) return std::nullopt;
  return Heading(*robot, first_s + segment.from_s, first_s + segment.to_s);
}

std::vector<TapedRanges> taped_ranges(const SwarmDataset& swarm, const SwarmRanges& all,
                                      const std::vector<TapeSegment>& tape) {
  std::vector<TapedRanges> taped;
  for (std::size_t k = 0; k < tape.size(); ++k) {
    const auto heading = heading_of(swarm, tape[k], all.first_s);
    for (const TapedPair& pair : tape[k].pairs) {
      TapedRanges part{.pair = pair.pair, .segment = k, .distance_m = pair.distance_m};
      const bool turns =
          heading && (pair.pair.a == tape[k].turning || pair.pair.b == tape[k].turning);
      if (turns) part.turning = tape[k].turning;
      for (const SwarmRange& range : all.ranges) {
        const double t_s = range.true_s - all.first_s;
        if (range.pair != pair.pair || t_s < tape[k].from_s || t_s > tape[k].to_s) continue;
        part.ranges.push_back(range.range);
        if (turns) part.headings_rad.push_back(heading->at(range.true_s));
      }
      taped.push_back(std::move(part));
    }
  }
  return taped;
}

/// The tape, and one segment more of pairs that rested all the time.
Result<std::vector<TapeSegment>> tape_of(const CalibrateRangeOptions& options,
                                         const SwarmDataset& swarm) {
  std::vector<TapeSegment> tape;
  if (!options.tape.empty()) {
    auto loaded = load_tape(options.tape);
    if (!loaded) return loaded;
    tape = std::move(*loaded);
  }
  if (options.distances.empty()) return tape;
  std::map<std::string, RobotId> names;
  for (const RobotRecording& robot : swarm.robots) names[robot.robot.name] = robot.robot.id;
  TapeSegment whole{.from_s = 0.0, .to_s = std::numeric_limits<double>::infinity(), .pairs = {}};
  for (const std::string& text : options.distances) {
    const auto pair = parse_distance(text, names);
    if (!pair) return tl::unexpected(pair.error());
    whole.pairs.push_back(*pair);
  }
  tape.push_back(std::move(whole));
  return tape;
}

/// The root mean square of a robot's rates between two times [rad/s]; 0 without samples.
double rate_rms_of(const RobotRecording& robot, double from_s, double to_s) {
  double squares = 0.0;
  double count = 0.0;
  for (const ImuSample& sample : robot.imu) {
    const double t_s = robot.robot.clock.true_s(sample.stamp);
    if (t_s < from_s || t_s > to_s) continue;
    squares += sample.gyro_radps.squaredNorm();
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(squares / count) : 0.0;
}

/// Robots that turned where they had to rest; empty if none did.
std::string moved_robots(const SwarmDataset& swarm, const std::vector<TapeSegment>& tape,
                         double first_s) {
  constexpr double kAtRest = 0.1;  // rad/s; a gyroscope's bias is less
  std::string moved;
  for (std::size_t k = 0; k < tape.size(); ++k) {
    const TapeSegment& segment = tape[k];
    for (const RobotRecording& robot : swarm.robots) {
      const RobotId id = robot.robot.id;
      const bool is_taped = std::ranges::any_of(segment.pairs, [id](const TapedPair& pair) {
        return pair.pair.a == id || pair.pair.b == id;
      });
      if (!is_taped || id == segment.turning) continue;
      const double rms = rate_rms_of(robot, first_s + segment.from_s, first_s + segment.to_s);
      if (rms <= kAtRest) continue;
      moved += fmt::format("{}{} in segment {} ({} deg/s RMS)", moved.empty() ? "" : ", ",
                           robot.robot.name, k + 1, fixed(kDegPerRad * rms, 0));
    }
  }
  if (moved.empty()) return "";
  return "turned: " + moved +
         "; robots must rest at their taped distances: give --tape the seconds in which they do";
}

LatePathLimits late_path_limits(const SwarmDataset& swarm) {
  LatePathLimits limits;
  for (const RobotRecording& robot : swarm.robots)
    limits[robot.robot.id] = robot.config.uwb.noise.late_path_db;
  return limits;
}

std::string file_text(const RangeCalibration& found) {
  std::string text = "# Written by crepesctl calibrate range: measured = distance + bias\n";
  text += "ranges:\n  pairs:\n";
  for (const PairBias& pair : found.pairs) {
    text += fmt::format("  - {{ids: [{}, {}], bias_m: {}}}\n", pair.pair.a.value, pair.pair.b.value,
                        to_yaml(pair.bias_m));
  }
  text += found.modules.empty() ? "  modules: []\n" : "  modules:\n";
  for (const ModuleBias& module : found.modules)
    text += fmt::format("  - {{id: {}, bias_m: {}}}\n", module.id.value, to_yaml(module.bias_m));
  return text;
}

/// What a pair's range is still off by, one sigma: the worst pair's estimate, and what the
/// directions of arrival change.
double remaining_bias(const RangeCalibration& found) {
  double worst = 0.0;
  for (const PairBias& pair : found.pairs) worst = std::max(worst, pair.sigma_m);
  return std::hypot(worst, found.direction_sigma_m);
}

/// The delay of every module. Where pairs do not determine them, the least delays that give each
/// measured pair its bias: two robots that ranged with nobody else have half of theirs each.
std::vector<ModuleBias> delays_of(const RangeCalibration& found) {
  if (!found.modules.empty()) return found.modules;
  std::map<RobotId, Eigen::Index> columns;
  for (const PairBias& pair : found.pairs) {
    for (const RobotId id : {pair.pair.a, pair.pair.b})
      columns.emplace(id, static_cast<Eigen::Index>(columns.size()));
  }
  const auto rows = static_cast<Eigen::Index>(found.pairs.size());
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(columns.size()));
  Eigen::VectorXd biases_m(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const PairBias& pair = found.pairs[static_cast<std::size_t>(i)];
    sums(i, columns.at(pair.pair.a)) = sums(i, columns.at(pair.pair.b)) = 1.0;
    biases_m[i] = pair.bias_m;
  }
  const Eigen::VectorXd delays_m = sums.completeOrthogonalDecomposition().solve(biases_m);
  std::vector<ModuleBias> delays;
  delays.reserve(columns.size());
  for (const auto& [id, column] : columns) delays.push_back({.id = id, .bias_m = delays_m[column]});
  return delays;
}

/// Whether the delays are right for all pairs of the swarm, not only for the measured ones.
bool knows_every_pair(const RangeCalibration& found, const SwarmDataset& swarm) {
  std::set<RobotId> members;
  for (const RobotRecording& robot : swarm.robots)
    for (const MemberConfig& member : robot.config.swarm.members) members.insert(member.id);
  if (members.size() == 2) return !found.pairs.empty();
  return std::ranges::all_of(members, [&](RobotId id) {
    return std::ranges::find(found.modules, id, &ModuleBias::id) != found.modules.end();
  });
}

double configured_delay_m(const SwarmConfig& swarm, RobotId id) {
  const auto member = std::ranges::find(swarm.members, id, &MemberConfig::id);
  return member == swarm.members.end() ? 0.0 : member->range_delay_m;
}

/// Pairs whose bias the configuration does not allow; empty if there are none. It is rather the
/// tape that is wrong.
std::string unexpected_biases(const RangeCalibration& found, const Config& config) {
  constexpr double kSigmas = 2.0;
  constexpr double kLeast_m = 0.1;  // what temperature and mounting may change
  const RangeNoise& noise = config.uwb.noise;
  const double most_m =
      std::max(kLeast_m, kSigmas * std::hypot(noise.bias_sigma_m, noise.bias_drift_m));
  std::string pairs;
  for (const PairBias& pair : found.pairs) {
    const double expected_m = configured_delay_m(config.swarm, pair.pair.a) +
                              configured_delay_m(config.swarm, pair.pair.b);
    if (std::abs(pair.bias_m - expected_m) <= most_m) continue;
    pairs += fmt::format("{}pair {},{}: {} m instead of {} m", pairs.empty() ? "" : ", ",
                         pair.pair.a.value, pair.pair.b.value, fixed(pair.bias_m, 2),
                         fixed(expected_m, 2));
  }
  if (pairs.empty()) return "";
  return fmt::format(
      "biases further from range_delay_m than uwb.bias_sigma_m allows, {} m: {}; is the tape "
      "right, from antenna to antenna?",
      fixed(most_m, 2), pairs);
}

/// By which a range changes as antennas turn: between rests, or in a module's turn.
double drift_of(const RangeCalibration& found) {
  double drift = found.direction_sigma_m;
  for (const ModulePattern& module : found.patterns) drift = std::max(drift, module.pattern.rms_m);
  return drift;
}

/// A fragment for `crepesd.d/` of every robot: delays, and the errors that are left.
std::string members_text(const RangeCalibration& found, bool knows_all) {
  constexpr double kLeastBias = 0.005;  // m; temperature moves an antenna delay by so much
  constexpr double kLeastNoise = 0.005;
  std::string text =
      "# Written by crepesctl calibrate range: copy it to crepesd.d/ on every robot.\n";
  text += "swarm:\n  members:\n";
  for (const ModuleBias& module : delays_of(found)) {
    text += fmt::format("  - {{id: {}, range_delay_m: {}}}\n", module.id.value,
                        fixed(module.bias_m, 4));
  }
  text += fmt::format("uwb:\n  noise_m: {}\n", fixed(std::max(found.noise_m, kLeastNoise), 3));
  if (knows_all) {
    text += fmt::format("  bias_sigma_m: {}\n  bias_drift_m: {}\n",
                        fixed(std::max(remaining_bias(found), kLeastBias), 3),
                        fixed(drift_of(found), 3));
  }
  if (found.late_path_db)
    text += fmt::format("  late_path_db: {}\n", fixed(*found.late_path_db, 1));
  return text;
}

/// FILE, and the fragment beside it.
Result<void> write_files(const RangeCalibration& found, bool knows_all,
                         const std::filesystem::path& out) {
  return write_text_file(out, file_text(found)).and_then([&] {
    return write_text_file(beside(out, kMembersSuffix), members_text(found, knows_all));
  });
}

Json json_of(const RangeCalibration& found) {
  Json json = report_head(found.refusals, found.warnings);
  if (!found.refusals.empty()) return json;
  json["pairs"] = Json::array();
  for (const PairBias& pair : found.pairs) {
    json["pairs"].push_back({{"ids", {pair.pair.a.value, pair.pair.b.value}},
                             {"bias_m", pair.bias_m},
                             {"sigma_m", pair.sigma_m}});
  }
  json["modules"] = Json::array();
  for (const ModuleBias& module : found.modules) {
    json["modules"].push_back(
        {{"id", module.id.value}, {"bias_m", module.bias_m}, {"sigma_m", module.sigma_m}});
  }
  json["patterns"] = Json::array();
  for (const ModulePattern& module : found.patterns) {
    json["patterns"].push_back({{"id", module.id.value},
                                {"ids", {module.pair.a.value, module.pair.b.value}},
                                {"rms_m", module.pattern.rms_m},
                                {"mean_sigma_m", module.pattern.mean_sigma_m},
                                {"deviation_m", module.pattern.deviation_m}});
  }
  json["noise_m"] = found.noise_m;
  json["direction_sigma_m"] = found.direction_sigma_m;
  if (found.late_path_db) json["late_path_db"] = *found.late_path_db;
  return json;
}

/// Deviations in centimeters over the heading. The daemon knows no pattern, only its size.
std::string patterns_text(const RangeCalibration& found) {
  if (found.patterns.empty()) return "";
  std::vector<std::vector<std::string>> rows{
      {"cm at heading", "0 deg", "45", "90", "135", "180", "225", "270", "315", "RMS"}};
  for (const ModulePattern& module : found.patterns) {
    std::vector<std::string>& row = rows.emplace_back();
    row.push_back(fmt::format("{} before {}", module.id.value,
                              (module.pair.a == module.id ? module.pair.b : module.pair.a).value));
    for (const double deviation : module.pattern.deviation_m)
      row.push_back(fixed(100.0 * deviation, 1));
    row.push_back(fixed(100.0 * module.pattern.rms_m, 1));
  }
  return "\n" + text_table(rows) +
         "The daemon takes no pattern off; it counts as uwb.bias_drift_m.\n";
}

std::string text_of(const RangeCalibration& found, bool knows_all,
                    const std::filesystem::path& out) {
  std::vector<std::vector<std::string>> segments{
      {"pair", "segment", "bias m", "noise m", "ranges", "late", "outliers"}};
  for (const SegmentBias& segment : found.segments) {
    segments.push_back({fmt::format("{},{}", segment.pair.a.value, segment.pair.b.value),
                        std::to_string(segment.segment + 1), fixed(segment.bias_m, 4),
                        fixed(segment.scatter_m, 3), std::to_string(segment.used),
                        std::to_string(segment.late), std::to_string(segment.outliers)});
  }
  std::vector<std::vector<std::string>> results{{"", "bias m", "+-"}};
  for (const PairBias& pair : found.pairs) {
    results.push_back({fmt::format("pair {},{}", pair.pair.a.value, pair.pair.b.value),
                       fixed(pair.bias_m, 4), fixed(pair.sigma_m, 4)});
  }
  for (const ModuleBias& module : found.modules) {
    results.push_back({fmt::format("module {}", module.id.value), fixed(module.bias_m, 4),
                       fixed(module.sigma_m, 4)});
  }
  return text_table(segments) + "\n" + text_table(results) + patterns_text(found) + "\n" +
         members_text(found, knows_all) + warning_lines(found.warnings) +
         fmt::format("written: {}\nwritten: {}, for crepesd.d/ of every robot\n", out.string(),
                     beside(out, kMembersSuffix).string());
}

}  // namespace

Result<CalibrationReport> calibrate_range(const CalibrateRangeOptions& options) {
  if (options.tape.empty() && options.distances.empty())
    return fail(ErrorCode::kUsage, "no distances: give --tape, or --distance r1,r2=5.00");
  const auto free =
      check_results({options.out, beside(options.out, kMembersSuffix)}, "range", options.force);
  if (!free) return tl::unexpected(free.error());
  const auto swarm = load_swarm(options.swarm_dir);
  if (!swarm) return tl::unexpected(swarm.error());
  if (const auto checked = check_modules(*swarm); !checked) return tl::unexpected(checked.error());
  const auto tape = tape_of(options, *swarm);
  if (!tape) return tl::unexpected(tape.error());
  if (options.on_progress) options.on_progress(0.7);
  const SwarmRanges ranges = ranges_of(*swarm);
  RangeCalibration found =
      calibrate_ranges(taped_ranges(*swarm, ranges, *tape), late_path_limits(*swarm));
  if (std::string moved = moved_robots(*swarm, *tape, ranges.first_s); !moved.empty())
    found.warnings.push_back(std::move(moved));
  const bool knows_all = knows_every_pair(found, *swarm);
  if (!knows_all) {
    found.warnings.emplace_back(
        "delays of pairs that were not measured are not known, so uwb.bias_sigma_m and "
        "bias_drift_m "
        "stay as configured; measure all three distances of every robot with two others");
  }
  if (std::string biases = unexpected_biases(found, swarm->robots.front().config); !biases.empty())
    found.warnings.push_back(std::move(biases));
  if (found.refusals.empty()) {
    if (const auto written = write_files(found, knows_all, options.out); !written)
      return tl::unexpected(written.error());
  }
  CalibrationReport report{.text = {}, .reasons = found.refusals, .faults = swarm->faults};
  if (options.json) {
    report.text = json_line(json_of(found));
  } else if (found.refusals.empty()) {
    report.text = text_of(found, knows_all, options.out);
  }
  return report;
}

}  // namespace crepes
