/// Twenty boards that wander, cross and merge in one view, over seeds.
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "estimator/vision/blink_tracker.hpp"
#include "estimator/vision/codebook.hpp"
#include "tests/support/blinking.hpp"

namespace crepes::blink_tracker_swarm_test {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kBoards = 20;
constexpr double kRateHz = 200.0;
constexpr Duration kPattern = 200ms;

const IdLibrary& library() {
  static const IdLibrary kLibrary = *IdLibrary::from(
      test::swarm_of(search_codebook({.slots = 20}, 64, {.steps = 200'000}).patterns));
  return kLibrary;
}

CameraCalibration camera() {
  CameraCalibration config;
  config.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
  config.resolution = {1280, 1024};
  Eigen::Matrix3d R_C_B;
  R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  config.T_cam_imu.q = Eigen::Quaterniond(R_C_B);
  return config;
}

/// A direction in the world that swings about, as a neighbor's does.
struct Wanderer {
  double azimuth, elevation, swing, speed, phase;
  [[nodiscard]] Eigen::Vector3d at(double t_s) const {
    const double a = azimuth + swing * std::sin(speed * t_s + phase);
    const double e = elevation + 0.5 * swing * std::cos(0.7 * speed * t_s + phase);
    return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
  }
};

class Swarm {
 public:
  explicit Swarm(unsigned seed) : random_(seed) {
    for (std::size_t i = 0; i < kBoards; ++i) {
      boards_.push_back({uniform(-1.0, 1.0), uniform(-0.5, 0.5), uniform(0.05, 0.4),
                         uniform(0.3, 2.0), uniform(0.0, 6.0)});
      phases_.push_back(from_seconds(uniform(0.0, 0.2)));
    }
  }

  /// The bearings of the next frame; the body nods and turns meanwhile.
  std::vector<Bearing> step() {
    t_s_ += 1.0 / kRateHz;
    const Timestamp now{from_seconds(t_s_)};
    const double rate = 2.0 * std::cos(5.0 * t_s_);
    R_W_B_ = Eigen::AngleAxisd(0.4 * std::sin(5.0 * t_s_), Eigen::Vector3d::UnitZ());
    ImuSample imu;
    imu.stamp = now;
    imu.gyro_radps = {0.0, 0.0, rate};
    tracker.add_imu(imu);
    SpotFrame frame;
    frame.stamp = now;
    std::normal_distribution<double> noise(0.0, 0.2);
    for (std::size_t i = 0; i < kBoards; ++i) {
      if (!library().entries()[i].code.is_lit(now.time_since_epoch() + phases_[i])) continue;
      if (uniform(0.0, 1.0) < 0.01) continue;
      const auto uv = model_.project(camera_.T_cam_imu.q * truth_B(i));
      if (uv && model_.contains(*uv))
        add({uv->x() + noise(random_), uv->y() + noise(random_)}, frame);
    }
    std::shuffle(frame.spots.begin(), frame.spots.end(), random_);
    lit_ += frame.spots.size();
    return tracker.step(frame);
  }

  [[nodiscard]] Eigen::Vector3d truth_B(std::size_t board) const {
    return R_W_B_.transpose() * boards_[board].at(t_s_);
  }
  [[nodiscard]] double t_s() const { return t_s_; }
  [[nodiscard]] std::size_t spots() const { return lit_; }

 private:
  double uniform(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(random_);
  }
  /// Two boards within a few pixels are one spot.
  static void add(const Eigen::Vector2d& uv, SpotFrame& frame) {
    for (Spot& spot : frame.spots)
      if (std::hypot(spot.u_px - uv.x(), spot.v_px - uv.y()) < 4.0) {
        spot.u_px = 0.5 * (spot.u_px + uv.x());
        spot.v_px = 0.5 * (spot.v_px + uv.y());
        return;
      }
    frame.spots.push_back({uv.x(), uv.y(), 12.0, 255.0, 1.0});
  }

  CameraCalibration camera_ = camera();
  CameraModel model_ = *CameraModel::from(camera_);
  std::mt19937 random_;
  std::vector<Wanderer> boards_;
  std::vector<Duration> phases_;
  Eigen::Matrix3d R_W_B_ = Eigen::Matrix3d::Identity();
  double t_s_ = 100.0;
  std::size_t lit_ = 0;

 public:
  BlinkTracker tracker{camera_, model_, VisionConfig{}, library()};
};

class BlinkTrackerSwarm : public testing::TestWithParam<unsigned> {};

TEST_P(BlinkTrackerSwarm, KeepsTwentyCrossingBoardsApart) {
  constexpr double kFar = 0.02;  // rad
  Swarm swarm(GetParam());
  std::size_t named = 0;
  std::map<RobotId, double> wrong_since_s;
  double longest_s = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const std::vector<Bearing> bearings = swarm.step();

    std::set<double> places;
    for (const Bearing& bearing : bearings) {
      EXPECT_TRUE(places.insert(bearing.u_B.y()).second) << "one spot in two tracks";
      const Eigen::Vector3d truth = swarm.truth_B(bearing.neighbor.value - 1U);
      if ((bearing.u_B - truth).norm() < kFar) {
        ++named;
        wrong_since_s.erase(bearing.neighbor);
        continue;
      }
      const auto [since, is_new] = wrong_since_s.try_emplace(bearing.neighbor, swarm.t_s());
      longest_s = std::max(longest_s, swarm.t_s() - since->second);
    }
    ASSERT_LE(swarm.tracker.status().tracks, 3 * kBoards);
  }

  EXPECT_LE(longest_s, to_seconds(kPattern));
  EXPECT_GT(static_cast<double>(named), 0.85 * static_cast<double>(swarm.spots()));
}
INSTANTIATE_TEST_SUITE_P(Seeds, BlinkTrackerSwarm, testing::Range(1U, 9U));

}  // namespace
}  // namespace crepes::blink_tracker_swarm_test
