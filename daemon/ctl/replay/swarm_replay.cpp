#include "daemon/ctl/replay/swarm_replay.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <set>
#include <string>
#include <utility>

#include "daemon/ctl/dataset/truth.hpp"
#include "daemon/ctl/replay/virtual_swarm.hpp"
#include "net/subscription/fault_text.hpp"

namespace crepes {
namespace {

/// Robots without inertial samples neither have poses nor are in anybody's. One of several may be
/// missing, as long as a pair is left.
Result<void> check_imu(const SwarmDataset& dataset, const std::filesystem::path& dir) {
  constexpr std::ptrdiff_t kPair = 2;
  const auto has_imu = [](const RobotRecording& robot) { return !robot.imu.empty(); };
  const auto silent = std::ranges::find_if_not(dataset.robots, has_imu);
  if (silent == dataset.robots.end() || std::ranges::count_if(dataset.robots, has_imu) >= kPair)
    return {};
  const std::string& last = dataset.faults.last();
  return fail(ErrorCode::kFormat,
              fmt::format("{}: no samples, so there are no poses{}{}",
                          (dir / silent->robot.dir / "imu0" / "data.csv").string(),
                          last.empty() ? "" : "; refused: ", last));
}

using Pairs = std::set<std::pair<RobotId, RobotId>>;

std::vector<std::string> notes_of(const ReplayReport& report, const ReplayOutput::Names& names,
                                  const Pairs& with_poses) {
  std::vector<std::string> notes;
  for (const RobotReport& robot : report.robots) {
    const std::string& observer = names.at(robot.robot);
    for (const TeamFault& fault : robot.status.faults)
      notes.push_back(fmt::format("{} of itself: {}", observer, text_of(fault)));
    for (const NeighborStatus& neighbor : robot.status.neighbors) {
      if (!with_poses.contains({robot.robot, neighbor.neighbor})) {
        notes.push_back(fmt::format("{} -> {}: no pose at any time; at the end: {}", observer,
                                    neighbor.name, name_of(neighbor.reason)));
      }
      for (const TeamFault& fault : neighbor.faults)
        notes.push_back(fmt::format("{} of {}: {}", observer, neighbor.name, text_of(fault)));
    }
  }
  return notes;
}

}  // namespace

Endpoint replay_address(RobotId robot) {
  constexpr std::uint16_t kPort = 47474;
  const auto high = static_cast<std::uint8_t>(robot.value >> 8U);
  return Endpoint::ipv4({10, 0, high, static_cast<std::uint8_t>(robot.value & 0xFFU)}, kPort);
}

MeshKey replay_swarm_key() { return MeshKey{{7}}; }

RobotKey replay_robot_key(RobotId robot) {
  const std::array<std::uint8_t, 32> seed{static_cast<std::uint8_t>(robot.value & 0xFFU),
                                          static_cast<std::uint8_t>(robot.value >> 8U)};
  return robot_key_of(seed);
}

Result<ReplayReport> replay_dataset(SwarmDataset dataset, const std::optional<SwarmTruth>& truth,
                                    const ReplayOptions& options, const ReplaySinks& sinks) {
  VirtualSwarm swarm(std::move(dataset), truth, options, sinks);
  if (auto done = swarm.run(options.on_progress); !done) return tl::unexpected(done.error());
  return swarm.report(options);
}

Result<ReplaySummary> replay_swarm(const ReplayOptions& options) {
  auto dataset = load_swarm(options.swarm_dir);
  if (!dataset) return tl::unexpected(dataset.error());
  if (auto good = check_imu(*dataset, options.swarm_dir); !good)
    return tl::unexpected(good.error());
  ReplayOutput::Names names;
  for (const RobotRecording& robot : dataset->robots) names[robot.robot.id] = robot.robot.name;
  for (const std::string& delayed : options.delays.robots) {
    if (std::ranges::none_of(dataset->robots, [&](const RobotRecording& recording) {
          return is_named(recording.robot, delayed);
        })) {
      return fail(ErrorCode::kUsage, fmt::format("--delayed: no robot \"{}\" in {}", delayed,
                                                 options.swarm_dir.string()));
    }
  }
  std::optional<SwarmTruth> truth;  // judges IDs for the report; no estimator sees it
  if (std::filesystem::exists(options.swarm_dir / "truth")) {
    auto loaded = SwarmTruth::load(options.swarm_dir, dataset->manifest);
    if (!loaded && options.reach_m > 0) return tl::unexpected(loaded.error());
    if (loaded) {
      truth = std::move(*loaded);
    } else {
      dataset->faults.add(options.swarm_dir / "truth", 0, "not used", loaded.error().message);
    }
  }
  if (options.reach_m > 0 && !truth)
    return fail(ErrorCode::kConfig, "who is in reach of whom is known by truth/, which is missing");
  auto output = ReplayOutput::create(
      options.out_dir, names,
      options.records ? ReplayOutput::Detail::kRecords : ReplayOutput::Detail::kPoses);
  if (!output) return tl::unexpected(output.error());

  ReplaySummary summary{.robots = dataset->robots.size(),
                        .duration_s = dataset->manifest.duration_s,
                        .faults = dataset->faults};
  Pairs with_poses;
  ReplaySinks sinks;
  sinks.on_pose = [&](RobotId observer, const NeighborPose& pose) {
    output->write(observer, pose);
    ++summary.poses;
    with_poses.insert({observer, pose.neighbor});
  };
  if (options.records) {
    sinks.on_records = [&](RobotId observer, const Records& records) {
      output->write(observer, records);
    };
  }
  const auto report = replay_dataset(std::move(*dataset), truth, options, sinks);
  if (!report) return tl::unexpected(report.error());
  if (auto done = output->finish(*report); !done) return tl::unexpected(done.error());
  summary.notes = notes_of(*report, names, with_poses);
  return summary;
}

}  // namespace crepes
