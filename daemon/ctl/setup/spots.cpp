#include "daemon/ctl/setup/spots.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/setup/spots_drawing.hpp"
#include "daemon/ctl/setup/spots_recording.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/part_file.hpp"
#include "estimator/vision/blink_tracker.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kTrail = 60;  // sightings: 0.3 s at 200 Hz

std::string name_of(RobotId id, const SwarmConfig& swarm) {
  for (const MemberConfig& member : swarm.members)
    if (member.id == id) return member.name;
  return {};
}

Result<std::size_t> camera_of(const SpotsOptions& options, const Config& config) {
  const auto& cameras = config.cameras;
  if (cameras.empty()) return fail(ErrorCode::kConfig, options.config.string() + ": no cameras");
  if (!options.camera) {
    const std::size_t index = camera_index_of(options.source);
    if (index < cameras.size()) return index;
    return fail(ErrorCode::kUsage,
                fmt::format("{}: {} has no cameras[{}]; name one with --camera",
                            options.source.string(), options.config.string(), index));
  }
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const CameraConfig& camera) {
    return camera.calibration.name == *options.camera;
  });
  if (found != cameras.end()) return static_cast<std::size_t>(found - cameras.begin());
  return fail(ErrorCode::kUsage,
              fmt::format("{}: no camera is named {}", options.config.string(), *options.camera));
}

void count(const PictureFindings& findings, Timestamp first, SpotsSummary& summary) {
  const Detection& found = findings.detection;
  ++summary.pictures;
  summary.duration_s = to_seconds(findings.stamp - first);
  summary.threshold.add(found.threshold);
  summary.background.add(found.background);
  summary.spots.add(found.spots.size());
  summary.all_spots += found.spots.size();
  summary.most_saturated = std::max(summary.most_saturated, found.saturated_share);
  summary.rejected += found.rejected;
  summary.failures += found.failure.empty() ? 0 : 1;
  summary.good += found.exposure == Exposure::kGood ? 1 : 0;
  summary.dark += found.exposure == Exposure::kDark ? 1 : 0;
  summary.bright += found.exposure == Exposure::kBright ? 1 : 0;
  for (const RobotSighting& robot : findings.robots) {
    const auto [entry, is_new] = summary.robots.try_emplace(robot.id);
    if (is_new) entry->second = {robot.name, 0, summary.duration_s};
    ++entry->second.pictures;
  }
}

/// One camera's detector and tracker.
class Inspector {
 public:
  Inspector(const Config& config, std::size_t index, CameraModel model, const IdLibrary& library,
            std::vector<ImuSample> imu)
      : swarm_(config.swarm),
        index_(static_cast<std::uint8_t>(index)),
        camera_(config.cameras[index].calibration),
        model_(std::move(model)),
        imu_(std::move(imu)),
        detector_(config.vision),
        tracker_(camera_, model_, config.vision, library, config.robot.id) {}

  [[nodiscard]] const CameraCalibration& camera() const { return camera_; }

  [[nodiscard]] PictureFindings inspect(const RecordedPicture& picture, const Frame& frame) {
    PictureFindings findings;
    findings.file = picture.file;
    findings.stamp = picture.stamp;
    findings.detection = detector_.detect({.pixels = frame.pixels.data(),
                                           .width = frame.width,
                                           .height = frame.height,
                                           .stride = frame.width});
    const auto& spots = findings.detection.spots;
    track({picture.stamp, index_, std::vector<Spot>(spots.begin(), spots.end())}, findings);
    return findings;
  }

  /// `frame` must outlive the findings.
  [[nodiscard]] PictureFindings inspect(const SpotFrame& frame) {
    PictureFindings findings;
    findings.stamp = frame.stamp;
    findings.detection.spots = frame.spots;
    if (frame.spots.empty()) findings.detection.exposure = Exposure::kDark;
    track(frame, findings);
    return findings;
  }

 private:
  void track(const SpotFrame& frame, PictureFindings& findings) {
    const Timestamp now = frame.stamp + from_seconds(camera_.timeshift_cam_imu);
    while (next_imu_ < imu_.size() && (next_imu_ == 0 || imu_[next_imu_ - 1].stamp < now))
      tracker_.add_imu(imu_[next_imu_++]);
    for (const Bearing& bearing : tracker_.step(frame)) {
      const auto uv = model_.project(camera_.T_cam_imu.q * bearing.u_B);
      if (!uv) continue;
      findings.robots.push_back(
          {bearing.neighbor, name_of(bearing.neighbor, swarm_), bearing, uv->x(), uv->y()});
    }
  }

  const SwarmConfig& swarm_;
  std::uint8_t index_;
  CameraCalibration camera_;
  CameraModel model_;
  std::vector<ImuSample> imu_;
  std::size_t next_imu_ = 0;
  SpotDetector detector_;
  BlinkTracker tracker_;
};

/// What goes into the folder of results: bearings.csv, and drawings with the robots' trails.
class Album {
 public:
  [[nodiscard]] static Result<Album> open(const SpotsOptions& options) {
    Album album(options);
    if (!options.out) return album;
    std::error_code status;
    fs::create_directories(*options.out, status);
    if (status)
      return fail(ErrorCode::kIo, fmt::format("{}: {}", options.out->string(), status.message()));
    auto bearings = PartFile::create(*options.out / "bearings.csv", kBearingHeader);
    if (!bearings) return tl::unexpected(bearings.error());
    album.bearings_ = std::move(*bearings);
    return album;
  }

  void add(const PictureFindings& findings) {
    if (!bearings_) return;
    for (const RobotSighting& seen : findings.robots)
      append_bearing_row(bearings_->text(), findings.stamp, seen.bearing, seen.u_px, seen.v_px);
    bearings_->flush_if_large();
  }

  [[nodiscard]] Result<void> draw(const Frame& frame, const PictureFindings& findings) {
    if (!folder_) return {};
    std::vector<DrawnRobot> robots;
    for (const RobotSighting& seen : findings.robots) {
      auto& trail = trails_[seen.id];
      trail.emplace_back(seen.u_px, seen.v_px);
      if (trail.size() > kTrail) trail.erase(trail.begin());
      robots.push_back({seen.id, seen.name, trail});
    }
    if (count_++ % every_ != 0) return {};
    const fs::path file = *folder_ / findings.file.stem().concat(".spots.png");
    return draw_spots(frame, findings.detection.spots, robots, picture_caption(findings), file);
  }

  [[nodiscard]] Result<void> publish() { return bearings_ ? bearings_->publish() : Result<void>{}; }

 private:
  explicit Album(const SpotsOptions& options) : folder_(options.out), every_(options.every) {}

  std::optional<fs::path> folder_;
  std::size_t every_;
  std::size_t count_ = 0;
  std::optional<PartFile> bearings_;
  std::map<RobotId, std::vector<Eigen::Vector2d>> trails_;
};

/// Reads the recording frame by frame and hands on what is found.
class Inspection {
 public:
  Inspection(Inspector& inspector, Album& album, const SpotsOptions& options)
      : inspector_(inspector), album_(album), options_(options) {}

  [[nodiscard]] Result<SpotsSummary> run(const SpotsRecording& recording) {
    const auto& [pictures, frames, imu] = recording;
    first_ = pictures.empty() ? frames.front().stamp : pictures.front().stamp;
    total_ = pictures.size() + frames.size();
    summary_.is_of_spots = pictures.empty();
    for (const RecordedPicture& picture : pictures)
      if (auto seen = look_at(picture); !seen) return tl::unexpected(seen.error());
    for (const SpotFrame& frame : frames) add(inspector_.inspect(frame));
    if (summary_.pictures > 0) return summary_;
    if (total_ == 1) return fail(ErrorCode::kFormat, last_fault_);
    return fail(ErrorCode::kFormat, fmt::format("{}: none of {} pictures can be used",
                                                options_.source.string(), total_));
  }

 private:
  [[nodiscard]] Result<void> look_at(const RecordedPicture& picture) {
    const Result<Frame> frame = read_gray_image(picture.file, inspector_.camera());
    if (!frame) {
      ++summary_.refused;
      last_fault_ = frame.error().message;
      if (options_.on_fault && total_ > 1) options_.on_fault(last_fault_);
      return {};
    }
    const PictureFindings findings = inspector_.inspect(picture, *frame);
    add(findings);
    return album_.draw(*frame, findings);
  }

  void add(const PictureFindings& findings) {
    if (options_.on_progress) {
      options_.on_progress(static_cast<double>(summary_.pictures + summary_.refused) /
                           static_cast<double>(total_));
    }
    count(findings, first_, summary_);
    album_.add(findings);
    if (options_.on_text && (options_.json || total_ == 1))
      options_.on_text(options_.json ? picture_json(findings) : picture_text(findings));
  }

  Inspector& inspector_;
  Album& album_;
  const SpotsOptions& options_;
  Timestamp first_{};
  std::size_t total_ = 0;
  SpotsSummary summary_;
  std::string last_fault_;
};

}  // namespace

Result<SpotsSummary> inspect_spots(const SpotsOptions& options) {
  const Result<Config> config = load_config(options.config);
  if (!config) return tl::unexpected(config.error());
  const auto in_config = [&](Error error) {
    return std::move(error).with_context(options.config.string());
  };
  const Result<std::size_t> index = camera_of(options, *config);
  if (!index) return tl::unexpected(index.error());
  const CameraCalibration& camera = config->cameras[*index].calibration;
  auto model = CameraModel::from(camera).map_error(in_config);
  if (!model) return tl::unexpected(model.error());
  const auto library = IdLibrary::from(config->swarm).map_error(in_config);
  if (!library) return tl::unexpected(library.error());
  const auto recording = load_spots_recording(options, *index, camera.rate_hz);
  if (!recording) return tl::unexpected(recording.error());
  auto album = Album::open(options);
  if (!album) return tl::unexpected(album.error());

  Inspector inspector(*config, *index, *model, *library, recording->imu);
  Result<SpotsSummary> summary = Inspection(inspector, *album, options).run(*recording);
  if (!summary) return summary;
  if (auto published = album->publish(); !published) return tl::unexpected(published.error());
  summary->is_automatic = config->vision.threshold == 0;
  summary->slot_ms = config->swarm.slot_ms;
  if (options.on_text)
    options.on_text(options.json ? summary_json(*summary) : summary_text(*summary));
  return summary;
}

}  // namespace crepes
