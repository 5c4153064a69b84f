#include "daemon/ctl/convert/replay_streams.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace crepes {
namespace {

namespace fs = std::filesystem;

Result<std::optional<SwarmRobot>> robot_named(const SwarmManifest* manifest,
                                              const std::string& name) {
  if (manifest == nullptr) return std::nullopt;
  const auto found = std::ranges::find(manifest->robots, name, &SwarmRobot::name);
  if (found != manifest->robots.end()) return *found;
  return fail(ErrorCode::kNotFound,
              fmt::format("swarm.yaml has no robot '{}', of which there are results", name));
}

Result<ReplayedPair> read_replayed(const fs::path& results, const PairName& name,
                                   const SwarmManifest* manifest) {
  const auto observer = robot_named(manifest, name.observer);
  if (!observer) return tl::unexpected(observer.error());
  const auto neighbor = robot_named(manifest, name.neighbor);
  if (!neighbor) return tl::unexpected(neighbor.error());
  auto files = read_pair(results, name);
  if (!files) return tl::unexpected(files.error());
  // Measurements are in the order in which they were fused.
  std::ranges::stable_sort(files->measurements, {}, &MeasurementRecord::stamp);
  return ReplayedPair{name, std::move(*files), *observer, *neighbor};
}

/// The first stamp of all rows.
Timestamp start_of(const std::vector<ReplayedPair>& pairs) {
  Timestamp start = Timestamp::max();
  for (const ReplayedPair& pair : pairs) {
    if (!pair.files.poses.empty()) start = std::min(start, pair.files.poses.front().stamp);
    if (!pair.files.measurements.empty())
      start = std::min(start, pair.files.measurements.front().stamp);
  }
  return start;
}

void add_pair(const ReplayedPair& pair, Timestamp start, const SwarmTruth* truth,
              std::vector<MessageStream>& streams) {
  const std::string& observer = pair.name.observer;
  const std::string both = observer + "/" + pair.name.neighbor;
  const auto time_s = [&pair, start](const auto& row) {
    return pair.observer ? pair.observer->clock.true_s(row.stamp) : to_seconds(row.stamp - start);
  };
  streams.push_back(stream_of("/tf", transform_kind(), pair.files.poses, time_s,
                              [observer, both](std::int64_t time_ns, const NeighborPose& row) {
                                return transform_json(time_ns, observer, both, row.T_B_N.pose);
                              }));
  streams.push_back(stream_of("/" + both + "/pose", pose_kind(), pair.files.poses, time_s,
                              [observer](std::int64_t time_ns, const NeighborPose& row) {
                                return pose_json(time_ns, observer, row.T_B_N.pose);
                              }));
  streams.push_back(stream_of("/" + both + "/estimate", estimate_kind(), pair.files.poses, time_s,
                              [&pair, truth](std::int64_t time_ns, const NeighborPose& row) {
                                const auto T_B_N =
                                    truth != nullptr ? truth->relative(pair.observer->id,
                                                                       pair.neighbor->id, row.stamp)
                                                     : std::nullopt;
                                return estimate_json(time_ns, row, T_B_N ? &*T_B_N : nullptr);
                              }));
  streams.push_back(stream_of("/" + both + "/innovation", innovation_kind(),
                              pair.files.measurements, time_s,
                              [](std::int64_t time_ns, const MeasurementRecord& row) {
                                return innovation_json(time_ns, row);
                              }));
}

}  // namespace

Result<std::vector<ReplayedPair>> read_replay(const fs::path& results,
                                              const SwarmManifest* manifest) {
  const std::vector<PairName> names = pairs_in(results);
  if (names.empty()) {
    return fail(ErrorCode::kNotFound, results.string() +
                                          ": neither swarm.yaml of a recording nor "
                                          "<observer>/<neighbor>.csv of a replay");
  }
  if (manifest == nullptr && names.front().observer != names.back().observer) {
    return fail(ErrorCode::kUsage,
                "the clocks of the robots differ: name the data set of the "
                "replay with --truth SWARM_DIR");
  }
  std::vector<ReplayedPair> pairs;
  for (const PairName& name : names) {
    auto pair = read_replayed(results, name, manifest);
    if (!pair) return tl::unexpected(pair.error());
    pairs.push_back(std::move(*pair));
  }
  return pairs;
}

std::vector<MessageStream> replay_streams(const std::vector<ReplayedPair>& pairs,
                                          const SwarmTruth* truth) {
  std::vector<MessageStream> streams;
  const Timestamp start = start_of(pairs);
  for (const ReplayedPair& pair : pairs) add_pair(pair, start, truth, streams);
  return streams;
}

}  // namespace crepes
