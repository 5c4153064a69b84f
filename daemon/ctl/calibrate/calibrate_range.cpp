#include "daemon/ctl/calibrate/calibrate_range.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "config/writing/config_writer.hpp"
#include "daemon/ctl/calibrate/tape.hpp"
#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"
#include "drivers/dataset/robot_folder.hpp"
#include "estimator/calibration/range/range_calibration.hpp"

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
      all.ranges.push_back({robot.robot.clock.true_s(range.stamp),
                            {std::min(self, range.neighbor), std::max(self, range.neighbor)},
                            range});
    }
  }
  std::ranges::stable_sort(all.ranges, {}, &SwarmRange::true_s);
  return all;
}

std::vector<TapedRanges> taped_ranges(const SwarmRanges& all,
                                      const std::vector<TapeSegment>& tape) {
  std::vector<TapedRanges> taped;
  for (std::size_t k = 0; k < tape.size(); ++k) {
    for (const TapedPair& pair : tape[k].pairs) {
      TapedRanges part{
          .pair = pair.pair, .segment = k, .distance_m = pair.distance_m, .ranges = {}};
      for (const SwarmRange& range : all.ranges) {
        const double t_s = range.true_s - all.first_s;
        if (range.pair == pair.pair && t_s >= tape[k].from_s && t_s <= tape[k].to_s)
          part.ranges.push_back(range.range);
      }
      taped.push_back(std::move(part));
    }
  }
  return taped;
}

std::string file_text(const RangeCalibration& found) {
  std::string text = "# Written by crepesctl calibrate range: measured = distance + bias\n";
  text += "ranges:\n  pairs:\n";
  for (const PairBias& pair : found.pairs)
    text += fmt::format("  - {{ids: [{}, {}], bias_m: {}}}\n", pair.pair.a.value, pair.pair.b.value,
                        to_yaml(pair.bias_m));
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

/// The delay of every module. Two robots that ranged with nobody else have half of their pair's
/// bias each: only the sum matters. Empty where the pairs do not determine them.
std::vector<ModuleBias> delays_of(const RangeCalibration& found) {
  if (!found.modules.empty() || found.pairs.size() != 1) return found.modules;
  const PairBias& pair = found.pairs.front();
  return {{pair.pair.a, 0.5 * pair.bias_m, pair.sigma_m},
          {pair.pair.b, 0.5 * pair.bias_m, pair.sigma_m}};
}

/// A fragment for `crepesd.d/` of every robot.
std::string members_text(const RangeCalibration& found) {
  constexpr double kLeastBias = 0.005;  // m; temperature moves an antenna delay by so much
  std::string text =
      "# Written by crepesctl calibrate range: copy it to crepesd.d/ on every robot.\n"
      "swarm:\n  members:\n";
  for (const ModuleBias& module : delays_of(found)) {
    text += fmt::format("  - {{id: {}, range_delay_m: {}}}\n", module.id.value,
                        fixed(module.bias_m, 4));
  }
  return text + fmt::format("uwb: {{bias_sigma_m: {}}}\n",
                            fixed(std::max(remaining_bias(found), kLeastBias), 3));
}

/// FILE, and where the pairs determine the modules, the fragment beside it.
Result<void> write_files(const RangeCalibration& found, const std::filesystem::path& out) {
  if (auto written = write_text_file(out, file_text(found)); !written) return written;
  if (delays_of(found).empty()) return {};
  return write_text_file(beside(out, kMembersSuffix), members_text(found));
}

Json json_of(const RangeCalibration& found) {
  Json json = report_head(found.refusals, found.warnings);
  if (!found.refusals.empty()) return json;
  json["pairs"] = Json::array();
  for (const PairBias& pair : found.pairs)
    json["pairs"].push_back({{"ids", {pair.pair.a.value, pair.pair.b.value}},
                             {"bias_m", pair.bias_m},
                             {"sigma_m", pair.sigma_m}});
  json["modules"] = Json::array();
  for (const ModuleBias& module : found.modules)
    json["modules"].push_back(
        {{"id", module.id.value}, {"bias_m", module.bias_m}, {"sigma_m", module.sigma_m}});
  json["noise_m"] = found.noise_m;
  json["direction_sigma_m"] = found.direction_sigma_m;
  if (found.late_path_db) json["late_path_db"] = *found.late_path_db;
  return json;
}

std::string text_of(const RangeCalibration& found, const std::filesystem::path& out) {
  std::vector<std::vector<std::string>> segments{
      {"pair", "segment", "bias m", "noise m", "ranges", "late", "outliers"}};
  for (const SegmentBias& segment : found.segments)
    segments.push_back({fmt::format("{},{}", segment.pair.a.value, segment.pair.b.value),
                        std::to_string(segment.segment + 1), fixed(segment.bias_m, 4),
                        fixed(segment.scatter_m, 3), std::to_string(segment.used),
                        std::to_string(segment.late), std::to_string(segment.outliers)});
  std::vector<std::vector<std::string>> results{{"", "bias m", "+-"}};
  for (const PairBias& pair : found.pairs)
    results.push_back({fmt::format("pair {},{}", pair.pair.a.value, pair.pair.b.value),
                       fixed(pair.bias_m, 4), fixed(pair.sigma_m, 4)});
  for (const ModuleBias& module : found.modules)
    results.push_back({fmt::format("module {}", module.id.value), fixed(module.bias_m, 4),
                       fixed(module.sigma_m, 4)});
  const std::string late =
      found.late_path_db ? fmt::format(", late_path_db: {}", fixed(*found.late_path_db, 0)) : "";
  return text_table(segments) + "\n" + text_table(results) +
         fmt::format("\nuwb: {{noise_m: {}, bias_drift_m: {}{}}}\n", fixed(found.noise_m, 3),
                     fixed(found.direction_sigma_m, 3), late) +
         warning_lines(found.warnings) + fmt::format("written: {}\n", out.string()) +
         (found.modules.empty() ? ""
                                : fmt::format("written: {}, for crepesd.d/ of every robot\n",
                                              beside(out, kMembersSuffix).string()));
}

}  // namespace

Result<CalibrationReport> calibrate_range(const CalibrateRangeOptions& options) {
  const auto tape = load_tape(options.tape);
  if (!tape) return tl::unexpected(tape.error());
  const auto swarm = load_swarm(options.swarm_dir);
  if (!swarm) return tl::unexpected(swarm.error());
  const RangeCalibration found = calibrate_ranges(taped_ranges(ranges_of(*swarm), *tape),
                                                  swarm->robots.front().config.uwb.noise);
  if (found.refusals.empty())
    if (const auto written = write_files(found, options.out); !written)
      return tl::unexpected(written.error());
  CalibrationReport report{.text = {}, .reasons = found.refusals, .faults = swarm->faults};
  if (options.json) {
    report.text = json_line(json_of(found));
  } else if (found.refusals.empty()) {
    report.text = text_of(found, options.out);
  }
  return report;
}

}  // namespace crepes
