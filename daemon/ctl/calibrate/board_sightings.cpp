#include "daemon/ctl/calibrate/board_sightings.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "drivers/camera/image_folder.hpp"
#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/spot_detector.hpp"

namespace crepes {
namespace {

/// Sightings under the robots' ids; a board that is seen twice in a frame is a mirror image of
/// itself, and neither is used.
class SightingsByBoard {
 public:
  void add(Timestamp stamp, const std::vector<Bearing>& bearings, const Pose& T_C_B,
           const CameraModel& model) {
    for (std::size_t i = 0; i < bearings.size(); ++i) {
      const RobotId id = bearings[i].neighbor;
      const auto same = std::ranges::count(bearings, id, &Bearing::neighbor);
      const auto uv = model.project(T_C_B.q * bearings[i].u_B);
      const bool was_read = bearings[i].how == Naming::kRead;
      if (same == 1 && was_read && uv)
        found_[id].push_back({.stamp = stamp, .board = 0, .uv = *uv});
    }
  }

  /// A robot that is hardly ever seen is somebody's mistake.
  [[nodiscard]] BoardSightings boards() && {
    constexpr std::size_t kLeastSightings = 100;
    BoardSightings all;
    for (auto& [id, sightings] : found_) {
      if (sightings.size() < kLeastSightings) continue;
      for (BoardSighting& sighting : sightings) sighting.board = all.boards.size();
      all.boards.push_back(id);
      all.sightings.insert(all.sightings.end(), sightings.begin(), sightings.end());
    }
    std::ranges::stable_sort(all.sightings, {}, &BoardSighting::stamp);
    return all;
  }

 private:
  std::map<RobotId, std::vector<BoardSighting>> found_;
};

/// The frames of spots.csv, or those that the detector finds in the pictures.
class FrameSource {
 public:
  FrameSource(const CameraRecording& recording, const CameraCalibration& camera,
              const VisionConfig& vision)
      : recording_(recording), camera_(camera), detector_(vision) {}

  [[nodiscard]] std::size_t size() const {
    return recording_.spots.empty() ? recording_.images.size() : recording_.spots.size();
  }
  [[nodiscard]] Timestamp stamp(std::size_t i) const {
    return recording_.spots.empty() ? recording_.images[i].stamp : recording_.spots[i].stamp;
  }
  [[nodiscard]] Result<SpotFrame> frame(std::size_t i) {
    if (!recording_.spots.empty()) return recording_.spots[i];
    const RecordedPicture& image = recording_.images[i];
    const auto picture = read_gray_image(image.file, camera_);
    if (!picture) return tl::unexpected(picture.error());
    const Detection found = detector_.detect({.pixels = picture->pixels.data(),
                                              .width = picture->width,
                                              .height = picture->height,
                                              .stride = picture->width});
    return SpotFrame{.stamp = image.stamp,
                     .camera = 0,
                     .spots = std::vector<Spot>(found.spots.begin(), found.spots.end())};
  }

 private:
  const CameraRecording& recording_;
  const CameraCalibration& camera_;
  SpotDetector detector_;
};

}  // namespace

Result<BoardSightings> board_sightings(const RobotRecording& recording,
                                       const CameraCalibration& camera, bool with_gyro) {
  const auto model = CameraModel::from(camera);
  if (!model) return tl::unexpected(model.error());
  const auto library = IdLibrary::from(recording.config.swarm);
  if (!library) return tl::unexpected(library.error());
  BlinkTracker tracker(camera, *model, recording.config.vision, *library,
                       recording.config.robot.id);
  FrameSource source(recording.cameras.front(), camera, recording.config.vision);
  SightingsByBoard by_board;
  auto sample = recording.imu.begin();
  for (std::size_t i = 0; i < source.size(); ++i) {
    for (; with_gyro && sample != recording.imu.end() && sample->stamp <= source.stamp(i); ++sample)
      tracker.add_imu(*sample);
    const Result<SpotFrame> frame = source.frame(i);
    if (!frame) return tl::unexpected(frame.error());
    by_board.add(frame->stamp, tracker.step(*frame), camera.T_cam_imu, *model);
  }
  BoardSightings all = std::move(by_board).boards();
  if (source.size() > 1) {
    all.frame_rate_hz = static_cast<double>(source.size() - 1) /
                        to_seconds(source.stamp(source.size() - 1) - source.stamp(0));
  }
  return all;
}

}  // namespace crepes
