#include "daemon/ctl/convert/swarm_streams.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "drivers/base/text_file.hpp"

namespace crepes {
namespace {

constexpr double kTruthRate = 50.0;  // Hz

std::string name_in(const SwarmDataset& dataset, RobotId id) {
  const auto& robots = dataset.manifest.robots;
  const auto found = std::ranges::find(robots, id, &SwarmRobot::id);
  return found == robots.end() ? std::to_string(id.value) : found->name;
}

/// The ranges to one neighbor, by their places in the list of all.
MessageStream ranges_to(const RobotRecording& robot, RobotId neighbor, const std::string& name) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < robot.ranges.size(); ++i)
    if (robot.ranges[i].neighbor == neighbor) places.push_back(i);
  const std::size_t size = places.size();
  return {.topic = "/" + robot.robot.name + "/range/" + name,
          .kind = range_kind(),
          .size = size,
          .time_s =
              [&robot, places](std::size_t i) {
                return robot.robot.clock.true_s(robot.ranges[places[i]].stamp);
              },
          .json = [&robot, places](std::size_t i, std::int64_t time_ns) -> Result<std::string> {
            return range_json(time_ns, robot.ranges[places[i]]);
          }};
}

void add_ranges(const SwarmDataset& dataset, const RobotRecording& robot,
                std::vector<MessageStream>& streams) {
  std::vector<RobotId> neighbors;
  for (const UwbRange& range : robot.ranges) {
    if (std::ranges::find(neighbors, range.neighbor) == neighbors.end())
      neighbors.push_back(range.neighbor);
  }
  std::ranges::sort(neighbors);
  for (const RobotId neighbor : neighbors)
    streams.push_back(ranges_to(robot, neighbor, name_in(dataset, neighbor)));
}

void add_camera(const RobotRecording& robot, std::size_t camera,
                std::vector<MessageStream>& streams) {
  const CameraRecording& recording = robot.cameras[camera];
  const std::string topic = fmt::format("/{}/cam{}", robot.robot.name, camera);
  const std::string frame = topic.substr(1);
  const auto time_s = [&robot](const auto& row) { return robot.robot.clock.true_s(row.stamp); };
  streams.push_back(stream_of(topic + "/spots", annotations_kind(), recording.spots, time_s,
                              [](std::int64_t time_ns, const SpotFrame& row) {
                                return annotations_json(time_ns, row.spots);
                              }));
  streams.push_back(stream_of(topic + "/image", picture_kind(), recording.images, time_s,
                              [frame](std::int64_t time_ns, const RecordedPicture& row) {
                                return read_text_file(row.file).map([&](const std::string& bytes) {
                                  return picture_json(time_ns, frame, bytes);
                                });
                              }));
}

}  // namespace

std::vector<MessageStream> swarm_streams(const SwarmDataset& dataset) {
  std::vector<MessageStream> streams;
  for (const RobotRecording& robot : dataset.robots) {
    streams.push_back(stream_of(
        "/" + robot.robot.name + "/imu", imu_kind(), robot.imu,
        [&robot](const ImuSample& row) { return robot.robot.clock.true_s(row.stamp); },
        [](std::int64_t time_ns, const ImuSample& row) { return imu_json(time_ns, row); }));
    add_ranges(dataset, robot, streams);
    for (std::size_t camera = 0; camera < robot.cameras.size(); ++camera)
      add_camera(robot, camera, streams);
  }
  return streams;
}

std::vector<MessageStream> truth_streams(const SwarmManifest& manifest, const SwarmTruth& truth) {
  std::vector<MessageStream> streams;
  const auto size = static_cast<std::size_t>(std::floor(manifest.duration_s * kTruthRate)) + 1;
  const auto time_s = [](std::size_t i) { return static_cast<double>(i) / kTruthRate; };
  for (const SwarmRobot& robot : manifest.robots) {
    streams.push_back({.topic = "/tf",
                       .kind = transform_kind(),
                       .size = size,
                       .time_s = time_s,
                       .json = [&robot, &truth, time_s](
                                   std::size_t i, std::int64_t time_ns) -> Result<std::string> {
                         const auto T_W_B = truth.pose(robot.id, time_s(i));
                         return T_W_B ? transform_json(time_ns, "world", robot.name, *T_W_B) : "";
                       }});
  }
  return streams;
}

}  // namespace crepes
