#include "tests/study/vision_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "estimator/core/constants.hpp"
#include "estimator/core/so3.hpp"
#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/codebook.hpp"
#include "estimator/vision/spot_detector.hpp"
#include "estimator/vision/tracking/camera_view.hpp"

namespace crepes::study {
namespace {

constexpr std::size_t kBoards = 4;
constexpr double kFrame_s = 0.005;
constexpr double kNear_px = 2.0;
constexpr Timestamp kStart{std::chrono::seconds{100}};

const std::vector<std::string>& patterns(bool is_foreign) {
  const auto search = [](std::uint64_t seed, std::size_t slots) {
    return search_codebook({.slots = slots, .distance = 4, .max_dark = 2}, 64,
                           {.seed = seed, .steps = 200'000, .on_progress = {}})
        .patterns;
  };
  static const std::vector<std::string> kOurs = search(1, 20);
  static const std::vector<std::string> kTheirs = search(77, 22);
  return is_foreign ? kTheirs : kOurs;
}

IdLibrary library_of(const std::vector<std::string>& codes) {
  SwarmConfig swarm;
  for (const std::string& pattern : codes) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
    member.pattern = pattern;
    swarm.members.push_back(member);
  }
  return IdLibrary::from(swarm).value();
}

/// The motions of a scene; robots fly around the camera, which turns in place.
class Stage {
 public:
  explicit Stage(const VisionScene& scene) : scene_(scene), random_(scene.seed) {
    std::uniform_real_distribution<double> turn(0.0, 2.0 * std::numbers::pi);
    for (Way& way : ways_)
      for (double& phase : way.phases) phase = turn(random_);
    for (std::size_t i = 0; i < kBoards; ++i) ways_[i].azimuth = radians(-45.0 + 30.0 * double(i));
  }

  [[nodiscard]] double yaw(double t_s) const {
    const double w = 2.0 * std::numbers::pi * scene_.turns_hz;
    return radians(scene_.peak_rate_dps) / w * std::sin(w * t_s);
  }
  [[nodiscard]] double yaw_rate(double t_s) const {
    const double w = 2.0 * std::numbers::pi * scene_.turns_hz;
    return radians(scene_.peak_rate_dps) * std::cos(w * t_s);
  }
  /// The board in the body.
  [[nodiscard]] Pose T_B_M(std::size_t board, double t_s) const {
    const Way& way = ways_[board];
    double azimuth = way.azimuth + 0.1 * std::sin(0.9 * t_s + way.phases[0]);
    double elevation = 0.15 * std::sin(0.7 * t_s + way.phases[1]);
    if (scene_.do_cross) {  // pairs swing through each other
      azimuth = (board < 2 ? -0.4 : 0.4) + (board % 2 == 0 ? 0.1 : -0.1) * std::sin(4.0 * t_s);
      elevation = board % 2 == 0 ? 0.0 : 1.5 / 317.0;
    }
    const double middle = 0.5 * (scene_.nearest_m + scene_.farthest_m);
    const double swing = 0.5 * (scene_.farthest_m - scene_.nearest_m);
    const double range = middle + swing * std::sin(0.8 * t_s + way.phases[2]);
    const double seen = azimuth - yaw(t_s);
    const Eigen::Vector3d toward(std::cos(seen) * std::cos(elevation),
                                 std::sin(seen) * std::cos(elevation), std::sin(elevation));
    const Eigen::Quaterniond facing = shortest_rotation(Eigen::Vector3d::UnitX(), -toward);
    const double tilt = scene_.tilt_rad * std::sin(1.1 * t_s + way.phases[3]);
    const double around = 0.5 * t_s + way.phases[4];
    return {range * toward,
            facing * so3_exp(tilt * Eigen::Vector3d(0.0, std::cos(around), std::sin(around)))};
  }

 private:
  struct Way {
    double azimuth = 0.0;
    std::array<double, 5> phases{};
  };
  const VisionScene& scene_;
  std::mt19937 random_;
  std::array<Way, kBoards> ways_{};
};

/// Frames that are lost in bursts of a mean length of 8.
VisionConfig config_of(const VisionScene& scene) {
  VisionConfig config;
  config.detector = scene.detector;
  return config;
}

std::vector<bool> lost_frames(const VisionScene& scene, std::size_t count) {
  constexpr double kEnd = 1.0 / 8.0;
  const double begin = kEnd * scene.lost_share / (1.0 - scene.lost_share);
  std::mt19937 random(static_cast<unsigned>(scene.seed + 99));
  std::uniform_real_distribution<double> chance;
  std::vector<bool> lost;
  bool is_lost = false;
  for (std::size_t i = 0; i < count; ++i) {
    is_lost = chance(random) < (is_lost ? 1.0 - kEnd : begin);
    lost.push_back(is_lost);
  }
  return lost;
}

/// A board's light and what was made of it.
struct Board {
  RobotId id{};
  BlinkCode code;
  double phase_s = 0.0;
  double rate = 1.0;
  double glimpsed_s = 0.0;
  std::optional<double> first_id_s;  ///< in glimpsed time
  bool was_hidden = false;           ///< since it was counted last

  [[nodiscard]] Duration time(double t_s) const { return from_seconds(phase_s + t_s * rate); }
};

class Trial {
 public:
  explicit Trial(const VisionScene& scene)
      : scene_(scene),
        stage_(scene),
        camera_(scene_camera(scene.effects)),
        model_(CameraModel::from(camera_).value()),
        ours_(library_of(patterns(false))),
        blinking_(library_of(patterns(scene.is_foreign))),
        renderer_(model_, scene.effects, scene.seed),
        detector_(config_of(scene)),
        tracker_(camera_, model_, VisionConfig{}, ours_) {
    std::mt19937 random(static_cast<unsigned>(scene.seed + 7));
    std::uniform_real_distribution<double> any(0.0, 1.0);
    for (std::size_t i = 0; i < kBoards; ++i) {
      const auto& [id, code] = blinking_.entries()[(5 + 17 * i + 3 * scene.seed) % 64];
      boards_.push_back({id, code, 10.0 * any(random), 1.0 + 4e-5 * (any(random) - 0.5), 0.0, {}});
    }
    for (std::size_t i = 0; i < kBoards; ++i)
      renderer_.add({scene.board,
                     [this, i](double t) { return camera_.T_cam_imu * stage_.T_B_M(i, t); },
                     [this, i](double t) { return is_shining(i, t); }});
  }

  VisionScore run() {
    const auto frames = static_cast<std::size_t>(scene_.duration_s / kFrame_s);
    const std::vector<bool> lost = lost_frames(scene_, frames);
    for (std::size_t k = 0; k < frames; ++k) {
      const double t = kFrame_s * static_cast<double>(k);
      add_gyro(t);
      if (!lost[k]) look(t);
    }
    score_.board_s = scene_.duration_s * static_cast<double>(boards_.size());
    for (const Board& board : boards_) {
      score_.never += board.first_id_s ? 0 : 1;
      score_.slowest_s = std::max(score_.slowest_s, board.first_id_s.value_or(board.glimpsed_s));
    }
    return std::move(score_);
  }

 private:
  [[nodiscard]] bool is_shining(std::size_t i, double t_s) const {
    return boards_[i].code.is_lit(boards_[i].time(t_s)) &&
           !(scene_.is_hidden && scene_.is_hidden(i, t_s));
  }

  void add_gyro(double t_s) {
    ImuSample imu;
    imu.stamp = stamp_of(t_s);
    std::normal_distribution<double> noise(0.0, 0.005);
    imu.gyro_radps = {noise(random_), noise(random_),
                      stage_.yaw_rate(t_s - 0.5 * kFrame_s) + noise(random_)};
    tracker_.add_imu(imu);
  }

  [[nodiscard]] static Timestamp stamp_of(double t_s) { return kStart + from_seconds(t_s); }

  void look(double t_s) {
    const auto& pixels = renderer_.render(t_s);
    const Detection found =
        detector_.detect({pixels.data(), model_.width(), model_.height(), model_.width()});
    const auto bearings = tracker_.step(
        {stamp_of(t_s), 0, std::vector<Spot>(found.spots.begin(), found.spots.end())});
    std::array<std::optional<Eigen::Vector2d>, kBoards> centers;
    for (std::size_t i = 0; i < kBoards; ++i)
      centers[i] = model_.project(camera_.T_cam_imu * stage_.T_B_M(i, t_s).p);
    const bool is_scored = t_s >= scene_.score_from_s;
    if (is_scored) score_spots(found, centers);
    score_bearings(bearings, centers, t_s);
    score_.pictures += is_scored ? 1 : 0;
  }

  /// The part of an exposure in which the board shines.
  [[nodiscard]] double share_lit(std::size_t i, double t_s) const {
    constexpr int kSteps = 8;
    double lit = 0.0;
    for (int step = 0; step < kSteps; ++step)
      lit += is_shining(i, t_s + scene_.effects.exposure_s * ((step + 0.5) / kSteps - 0.5)) ? 1 : 0;
    return lit / kSteps;
  }

  /// How much later than the middle of the picture the row is exposed.
  [[nodiscard]] double exposed_after_s(const Eigen::Vector2d& uv) const {
    return scene_.effects.row_delay_s * (uv.y() - 0.5 * (model_.height() - 1));
  }

  [[nodiscard]] bool is_counted(const Eigen::Vector2d& uv) const {
    if (scene_.effects.glare) {  // in front of it nothing can be seen
      const Eigen::Vector2d d = uv - scene_.effects.glare->center;
      const Eigen::Vector2d half = scene_.effects.glare->half_size + Eigen::Vector2d(15.0, 15.0);
      const bool is_inside = scene_.effects.glare->is_disc
                                 ? d.norm() < half.x()
                                 : (d.cwiseAbs().array() < half.array()).all();
      if (is_inside) return false;
    }
    constexpr double kMargin = 30.0;
    return uv.x() > kMargin && uv.y() > kMargin && uv.x() < model_.width() - kMargin &&
           uv.y() < model_.height() - kMargin;
  }

  void score_spots(const Detection& found,
                   const std::array<std::optional<Eigen::Vector2d>, kBoards>& centers) {
    for (const Spot& spot : found.spots) {
      const bool is_board = std::any_of(centers.begin(), centers.end(), [&](const auto& center) {
        const double reach = 40.0 + 450.0 * scene_.board.radius_m / scene_.nearest_m;
        return center && (*center - Eigen::Vector2d(spot.u_px, spot.v_px)).norm() < reach;
      });
      score_.false_spots += is_board ? 0 : 1;
      if (is_board) score_.peaks.push_back(spot.peak - scene_.effects.background);
    }
  }

  void score_bearings(const std::vector<Bearing>& bearings,
                      const std::array<std::optional<Eigen::Vector2d>, kBoards>& centers,
                      double t_s) {
    std::array<bool, kBoards> is_found{};
    const bool is_scored = t_s >= scene_.score_from_s;
    for (const Bearing& bearing : bearings) {
      const Eigen::Vector2d uv = model_.project(camera_.T_cam_imu.q * bearing.u_B).value();
      std::optional<std::size_t> named;
      double nearest = 1e9;
      double own = 1e9;
      for (std::size_t i = 0; i < kBoards; ++i) {
        if (!centers[i]) continue;
        const double off = (uv - *centers[i]).norm();
        nearest = std::min(nearest, off);
        if (boards_[i].id == bearing.neighbor && !scene_.is_foreign) {
          named = i;
          own = off;
        }
      }
      if (named && own <= kNear_px) {
        is_found.at(*named) = true;
        if (is_scored) score_.errors_px.push_back(own);
        if (is_scored && bearing.how == Naming::kPredicted) ++score_.predicted;
      } else if (!named || nearest <= kNear_px) {
        ++score_.wrong;
      } else {
        ++score_.astray;
      }
    }
    for (std::size_t i = 0; i < kBoards; ++i) {
      Board& board = boards_[i];
      if (is_found[i] && !board.first_id_s) board.first_id_s = board.glimpsed_s;
      const bool is_hidden = scene_.is_hidden && scene_.is_hidden(i, t_s);
      board.was_hidden = board.was_hidden || is_hidden;
      if (!is_hidden) board.glimpsed_s += kFrame_s;
      if (!is_scored || !centers[i] || !is_counted(*centers[i])) continue;
      if (share_lit(i, t_s + exposed_after_s(*centers[i])) < 0.5) continue;
      ++score_.lit;
      score_.identified += is_found[i] ? 1 : 0;
      if (!std::exchange(board.was_hidden, false)) continue;
      ++score_.returns;
      score_.unnamed_returns += is_found[i] ? 0 : 1;
    }
  }

  const VisionScene& scene_;
  Stage stage_;
  CameraCalibration camera_;
  CameraModel model_;
  IdLibrary ours_;
  IdLibrary blinking_;
  BoardRenderer renderer_;
  SpotDetector detector_;
  BlinkTracker tracker_;
  std::vector<Board> boards_;
  std::mt19937 random_{3};
  VisionScore score_;
};

}  // namespace

CameraCalibration scene_camera(const PictureEffects& effects) {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.intrinsics = {-0.1723, 0.5931, 316.8, 316.6, 638.2, 512.5};
  camera.resolution = {1280, 1024};
  camera.rate_hz = 1.0 / kFrame_s;
  camera.rolling_shutter_us_per_row = 1e6 * effects.row_delay_s;
  Eigen::Matrix3d R_C_B;
  R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  camera.T_cam_imu.q = Eigen::Quaterniond(R_C_B);
  return camera;
}

VisionScore score_vision(const VisionScene& scene) { return Trial(scene).run(); }

double VisionScore::right_percent() const {
  return 100.0 * static_cast<double>(identified) /
         static_cast<double>(std::max<std::size_t>(1, lit));
}

void VisionScore::add(const VisionScore& other) {
  lit += other.lit;
  identified += other.identified;
  predicted += other.predicted;
  wrong += other.wrong;
  astray += other.astray;
  false_spots += other.false_spots;
  pictures += other.pictures;
  returns += other.returns;
  unnamed_returns += other.unnamed_returns;
  never += other.never;
  board_s += other.board_s;
  slowest_s = std::max(slowest_s, other.slowest_s);
  errors_px.insert(errors_px.end(), other.errors_px.begin(), other.errors_px.end());
  peaks.insert(peaks.end(), other.peaks.begin(), other.peaks.end());
}

RingScore score_rings(const RingPictures& rings) {
  CameraCalibration small = scene_camera({});
  small.intrinsics = {-0.1723, 0.5931, 316.8, 316.6, 240.2, 191.6};
  small.resolution = {480, 384};
  small.T_cam_imu = {};
  const CameraModel model = CameraModel::from(small).value();
  const CameraView view(small, model);
  std::vector<LightSighting> sightings;
  SpotDetector detector{VisionConfig{}};
  std::mt19937 random(rings.seed);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  RingScore score;
  for (; score.pictures < rings.pictures; ++score.pictures) {
    const auto k = static_cast<std::size_t>(score.pictures);
    LedBoard board{.leds = rings.leds[k % rings.leds.size()],
                   .radius_m = rings.radii_m[random() % rings.radii_m.size()],
                   .is_square = rings.is_square,
                   .veil = rings.veil};
    const double range = 0.5 * (rings.nearest_m + rings.farthest_m) +
                         0.5 * (rings.farthest_m - rings.nearest_m) * part(random);
    const Eigen::Vector3d toward =
        Eigen::Vector3d(0.15 * part(random), 0.12 * part(random), 1.0).normalized();
    const Eigen::Quaterniond facing = shortest_rotation(Eigen::Vector3d::UnitX(), -toward);
    const double around = std::numbers::pi * part(random);
    const Eigen::Quaterniond tilt = so3_exp(
        rings.tilt_rad * part(random) * Eigen::Vector3d(0.0, std::cos(around), std::sin(around)));
    const Eigen::Quaterniond roll =
        so3_exp(std::numbers::pi * part(random) * Eigen::Vector3d::UnitX());
    const Pose T_C_M{range * toward, facing * tilt * roll};
    BoardRenderer renderer(model, {}, k + 1000 * rings.seed);
    renderer.add({board, [&](double) { return T_C_M; }, [](double) { return true; }});
    const auto& pixels = renderer.render(0.0);
    const Detection found =
        detector.detect({pixels.data(), model.width(), model.height(), model.width()});
    if (found.spots.size() != 1) continue;
    ++score.one_spot;
    const Eigen::Vector2d center = model.project(T_C_M.p).value();
    const double off = (center - Eigen::Vector2d(found.spots[0].u_px, found.spots[0].v_px)).norm();
    score.centered += off <= 1.0 ? 1 : 0;
    (void)view.unproject({.spots = {found.spots[0]}}, {}, {}, 1, sightings);
    const LightSighting& sighting = sightings.at(0);
    if (sighting.ring_leds != board.leds) continue;
    // The corners of a square of four are a ring of four.
    const double radius_m = board.radius_m * (board.is_square && board.leds == 4 ? M_SQRT2 : 1.0);
    score.distance_errors.push_back(radius_m / sighting.ring_tan / range - 1.0);
  }
  return score;
}

}  // namespace crepes::study
