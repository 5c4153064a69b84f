#include "daemon/ctl/setup/spots.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "config/reading/config_file.hpp"
#include "daemon/ctl/setup/spots_drawing.hpp"
#include "drivers/dataset/picture_list.hpp"
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
  Inspector(const Config& config, std::size_t index, CameraModel model, const IdLibrary& library)
      : swarm_(config.swarm),
        index_(static_cast<std::uint8_t>(index)),
        camera_(config.cameras[index].calibration),
        model_(std::move(model)),
        detector_(config.vision),
        tracker_(camera_, model_, config.vision, library) {}

  /// Reads the picture. It must have the size of this camera's pictures.
  [[nodiscard]] Result<Frame> read(const fs::path& file) const {
    auto frame = read_gray_image(file);
    if (!frame || (frame->width == model_.width() && frame->height == model_.height()))
      return frame;

    return fail(ErrorCode::kFormat, fmt::format("{}: is {}x{}, but {} takes pictures of {}x{}",
                                                file.string(), frame->width, frame->height,
                                                camera_.name, model_.width(), model_.height()));
  }

  [[nodiscard]] PictureFindings inspect(const RecordedPicture& picture, const Frame& frame) {
    PictureFindings findings;
    findings.file = picture.file;
    findings.stamp = picture.stamp;
    findings.detection = detector_.detect({.pixels = frame.pixels.data(),
                                           .width = frame.width,
                                           .height = frame.height,
                                           .stride = frame.width});
    const auto& spots = findings.detection.spots;
    const auto bearings =
        tracker_.step({picture.stamp, index_, std::vector<Spot>(spots.begin(), spots.end())});
    for (const Bearing& bearing : bearings) {
      const auto uv = model_.project(camera_.T_cam_imu.q * bearing.u_B);
      if (!uv) continue;
      findings.robots.push_back(
          {bearing.neighbor, name_of(bearing.neighbor, swarm_), uv->x(), uv->y()});
    }
    return findings;
  }

 private:
  const SwarmConfig& swarm_;
  std::uint8_t index_;
  CameraCalibration camera_;
  CameraModel model_;
  SpotDetector detector_;
  BlinkTracker tracker_;
};

/// The trails of the robots, and the drawn pictures.
class Album {
 public:
  explicit Album(const SpotsOptions& options) : folder_(options.out), every_(options.every) {}

  [[nodiscard]] Result<void> open() const {
    if (!folder_) return {};
    std::error_code status;
    fs::create_directories(*folder_, status);
    if (!status) return {};
    return fail(ErrorCode::kIo, fmt::format("{}: {}", folder_->string(), status.message()));
  }

  [[nodiscard]] Result<void> add(const Frame& frame, const PictureFindings& findings) {
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

 private:
  std::optional<fs::path> folder_;
  std::size_t every_;
  std::size_t count_ = 0;
  std::map<RobotId, std::vector<Eigen::Vector2d>> trails_;
};

Result<SpotsSummary> inspect_all(const std::vector<RecordedPicture>& pictures, Inspector& inspector,
                                 const SpotsOptions& options) {
  SpotsSummary summary;
  Album album(options);
  if (auto opened = album.open(); !opened) return tl::unexpected(opened.error());
  std::string last_fault;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    if (options.on_progress)
      options.on_progress(static_cast<double>(i) / static_cast<double>(pictures.size()));
    const Result<Frame> frame = inspector.read(pictures[i].file);
    if (!frame) {
      ++summary.refused;
      last_fault = frame.error().message;
      if (options.on_fault && pictures.size() > 1) options.on_fault(last_fault);
      continue;
    }
    const PictureFindings findings = inspector.inspect(pictures[i], *frame);
    count(findings, pictures.front().stamp, summary);
    if (options.on_text && (options.json || pictures.size() == 1))
      options.on_text(options.json ? picture_json(findings) : picture_text(findings));
    if (auto drawn = album.add(*frame, findings); !drawn) return tl::unexpected(drawn.error());
  }
  if (summary.pictures > 0) return summary;
  if (pictures.size() == 1) return fail(ErrorCode::kFormat, last_fault);
  return fail(ErrorCode::kFormat, fmt::format("{}: none of {} pictures can be used",
                                              options.source.string(), pictures.size()));
}

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
  const auto pictures = list_pictures(options.source, camera.rate_hz);
  if (!pictures) return tl::unexpected(pictures.error());

  Inspector inspector(*config, *index, *model, *library);
  Result<SpotsSummary> summary = inspect_all(*pictures, inspector, options);
  if (!summary) return summary;
  summary->is_automatic = config->vision.threshold == 0;
  if (options.on_text)
    options.on_text(options.json ? summary_json(*summary) : summary_text(*summary));
  return summary;
}

}  // namespace crepes
