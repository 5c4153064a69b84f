#include "daemon/ctl/score/swarm_score.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "daemon/ctl/dataset/replay_pairs.hpp"
#include "daemon/ctl/replay/replay_output.hpp"
#include "drivers/dataset/pose_file.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// Clock offsets need a few packets; before this time they are not scored [s].
constexpr double kClockSettling = 3.0;

void score(ScoredPair& pair, const SwarmTruth& truth, double duration_s, double after_s) {
  const RobotClock& clock = pair.observer.clock;
  const auto relative = [&](Timestamp local) {
    return truth.relative(pair.observer.id, pair.neighbor.id, local);
  };
  pair.score = score_pair(pair.poses, relative, clock.local(0.0),
                          {.begin = clock.local(after_s), .end = clock.local(duration_s)});
}

Result<std::vector<NeighborPose>> read_pair(const fs::path& results, const ScoredPair& pair,
                                            std::size_t& files) {
  const fs::path file = results / pair.observer.name / (pair.neighbor.name + ".csv");
  auto poses = read_pose_file(file, pair.neighbor.id);
  if (poses) ++files;
  if (!poses && poses.error().code == ErrorCode::kNotFound) return std::vector<NeighborPose>{};
  return poses;
}

std::vector<ClockScore> score_clocks(const std::vector<ClockSample>& samples,
                                     const SwarmManifest& manifest) {
  std::map<RobotId, RobotClock> clocks;
  for (const SwarmRobot& robot : manifest.robots) clocks[robot.id] = robot.clock;
  std::map<std::pair<RobotId, RobotId>, ClockScore> scores;
  for (const ClockSample& sample : samples) {
    const double true_s = clocks[sample.observer].true_s(sample.stamp);
    if (true_s < kClockSettling) continue;
    const RobotId peer = sample.clock.peer;
    const double offset_s = to_seconds(clocks[peer].local(true_s) - sample.stamp);
    ClockScore& score = scores[{sample.observer, peer}];
    score.observer = sample.observer;
    score.peer = peer;
    score.max_error_s = std::max(score.max_error_s, std::abs(sample.clock.offset_s - offset_s));
    ++score.samples;
  }
  std::vector<ClockScore> list;
  list.reserve(scores.size());
  for (const auto& [pair, score] : scores) list.push_back(score);
  return list;
}

}  // namespace

Result<SwarmScore> score_swarm(const fs::path& results, const SwarmManifest& manifest,
                               const SwarmTruth& truth, double after_s,
                               const std::function<void(double)>& on_progress) {
  if (auto same = check_same_recording(results, manifest); !same)
    return tl::unexpected(same.error());
  const std::size_t pairs = manifest.robots.size() * (manifest.robots.size() - 1);
  SwarmScore swarm;
  std::size_t files = 0;
  ReplayOutput::Names names;
  for (const SwarmRobot& observer : manifest.robots) {
    names[observer.id] = observer.name;
    for (const SwarmRobot& neighbor : manifest.robots) {
      if (neighbor.id == observer.id) continue;
      ScoredPair pair{.observer = observer, .neighbor = neighbor, .poses = {}, .score = {}};
      auto poses = read_pair(results, pair, files);
      if (!poses) return tl::unexpected(poses.error());
      pair.poses = std::move(*poses);
      score(pair, truth, manifest.duration_s, after_s);
      swarm.pairs.push_back(std::move(pair));
      if (on_progress)
        on_progress(static_cast<double>(swarm.pairs.size()) / static_cast<double>(pairs));
    }
  }
  if (files == 0) return tl::unexpected(no_pairs_in(results));
  auto clocks = read_clock_samples(results / "report.json", names);
  if (clocks) {
    swarm.clocks = score_clocks(*clocks, manifest);
  } else if (clocks.error().code != ErrorCode::kNotFound) {
    return tl::unexpected(clocks.error());
  }
  return swarm;
}

void score_common_rows(SwarmScore& a, SwarmScore& b, const SwarmManifest& manifest,
                       const SwarmTruth& truth, double after_s) {
  const auto earlier = [](const NeighborPose& x, const NeighborPose& y) {
    return x.stamp < y.stamp;
  };
  for (std::size_t i = 0; i < a.pairs.size(); ++i) {
    for (auto [mine, other] : {std::pair(&a.pairs[i], &b.pairs[i]), {&b.pairs[i], &a.pairs[i]}}) {
      ScoredPair common{
          .observer = mine->observer, .neighbor = mine->neighbor, .poses = {}, .score = {}};
      std::set_intersection(mine->poses.begin(), mine->poses.end(), other->poses.begin(),
                            other->poses.end(), std::back_inserter(common.poses), earlier);
      score(common, truth, manifest.duration_s, after_s);
      common.score.availability = mine->score.availability;
      mine->score = common.score;
    }
  }
}

}  // namespace crepes
