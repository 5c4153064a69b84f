#include "tests/study/replay_scores.hpp"

#include <optional>

namespace crepes::study {

std::vector<OrderedPair> pairs_of(const Swarm& swarm) {
  std::vector<OrderedPair> pairs;
  for (const SwarmRobot& observer : swarm.dataset.manifest.robots) {
    for (const SwarmRobot& neighbor : swarm.dataset.manifest.robots)
      if (neighbor.id != observer.id) pairs.emplace_back(observer.id, neighbor.id);
  }
  return pairs;
}

Result<PairScores> replay_scores(const Swarm& swarm, const ReplayOptions& options, double after_s,
                                 const ReplayHooks& hooks) {
  std::map<OrderedPair, std::vector<NeighborPose>> poses;
  ReplaySinks sinks;
  sinks.on_pose = [&poses](RobotId observer, const NeighborPose& pose) {
    poses[{observer, pose.neighbor}].push_back(pose);
  };
  sinks.on_report = hooks.on_report;
  if (hooks.on_team) {
    sinks.on_records = [&hooks](RobotId observer, const Records& records) {
      for (const TeamRecord& record : records.team) hooks.on_team(observer, record);
    };
  }
  const auto report = replay_dataset(swarm.dataset, std::nullopt, options, sinks);
  if (!report) return tl::unexpected(report.error());

  PairScores scores;
  for (const OrderedPair& pair : pairs_of(swarm)) {
    const RobotClock& clock = recording_of(swarm.dataset, pair.first).robot.clock;
    const auto truth = [&](Timestamp local) {
      return swarm.truth.relative(pair.first, pair.second, local);
    };
    scores[pair] =
        score_pair(poses[pair], truth, clock.local(0.0),
                   {clock.local(after_s), clock.local(swarm.dataset.manifest.duration_s)});
  }
  return scores;
}

}  // namespace crepes::study
