#include "estimator/vision/blink_tracker.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace crepes::blink_tracker_test {
namespace {

using namespace std::chrono_literals;

/// Boards and lamps in front of one camera at 200 Hz; positions in a world whose axes are the
/// body's at rest, origin at the body.
class BlinkTrackerTest : public testing::Test {
 public:
  static SwarmConfig swarm() {
    SwarmConfig swarm;
    for (const char* pattern : {"001001011111111111", "001010101111111111", "001011110011111111"}) {
      MemberConfig member;
      member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
      member.pattern = pattern;
      swarm.members.push_back(member);
    }
    return swarm;
  }
  static CameraCalibration camera() {
    CameraCalibration config;
    config.name = "cam0";
    config.intrinsics = {-0.1723, 0.5931, 316.9, 316.8, 638.2, 512.5};
    config.resolution = {1280, 1024};
    Eigen::Matrix3d R_C_B;
    R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
    config.T_cam_imu = {Eigen::Vector3d(0.0, 0.01, -0.06), Eigen::Quaterniond(R_C_B)};
    config.timeshift_cam_imu = 0.002;
    return config;
  }

 protected:
  struct Board {
    std::size_t code;  ///< index into the library
    std::function<Eigen::Vector3d(double)> p_W;
  };

  /// What the tracker makes of the next frame; nothing if the frame is lost.
  std::vector<Bearing> step(bool is_lost = false) {
    now_ += 5ms;
    const Timestamp body = now_ + 2ms;
    const double t = to_seconds(body.time_since_epoch()) - 100.0;
    q_W_B_ = Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rate_radps_ * t, Eigen::Vector3d::UnitZ()));
    ImuSample imu;
    imu.stamp = body;
    imu.gyro_radps = {0.0, 0.0, yaw_rate_radps_};
    tracker_.add_imu(imu);

    SpotFrame frame;
    frame.stamp = now_;
    std::normal_distribution<double> noise(0.0, jitter_px_);
    for (std::size_t i = 0; i < boards_.size(); ++i) {
      const Board& board = boards_[i];
      if (board.code < 3 && !library_.entries()[board.code].code.is_lit(body.time_since_epoch() +
                                                                        Duration{i * 37'000'000}))
        continue;
      const Eigen::Vector3d p_B = q_W_B_.conjugate() * board.p_W(t);
      const auto uv = model_.project(camera_.T_cam_imu * p_B);
      if (uv && model_.contains(*uv))
        frame.spots.push_back({uv->x() + noise(random_), uv->y() + noise(random_), 12.0, 255.0});
    }
    // Two boards within a few pixels are one spot.
    for (std::size_t i = 0; i + 1 < frame.spots.size(); ++i)
      for (std::size_t j = i + 1; j < frame.spots.size(); ++j)
        if (std::hypot(frame.spots[i].u_px - frame.spots[j].u_px,
                       frame.spots[i].v_px - frame.spots[j].v_px) < 4.0) {
          frame.spots[i].u_px = 0.5 * (frame.spots[i].u_px + frame.spots[j].u_px);
          frame.spots[i].v_px = 0.5 * (frame.spots[i].v_px + frame.spots[j].v_px);
          frame.spots.erase(frame.spots.begin() + static_cast<std::ptrdiff_t>(j--));
        }
    std::shuffle(frame.spots.begin(), frame.spots.end(), random_);
    frame_ = frame;
    return is_lost ? std::vector<Bearing>{} : tracker_.step(frame, expected_);
  }

  /// Its robot's pose says where the board is, within 1 cm.
  ExpectedBoard pose_of(std::size_t board, double v_y_mps = 0.0) const {
    const double t = to_seconds(now_.time_since_epoch()) - 100.0;
    return {.robot = RobotId{static_cast<std::uint16_t>(board + 1)},
            .stamp = now_,
            .p_B_M = q_W_B_.conjugate() * boards_[board].p_W(t),
            .v_B_M = q_W_B_.conjugate() * Eigen::Vector3d(0.0, v_y_mps, 0.0),
            .covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity()};
  }

  /// Angle between a bearing and the board it names [rad].
  double error_of(const Bearing& bearing, std::size_t board) const {
    const double t = to_seconds(bearing.stamp.time_since_epoch()) - 100.0;
    const Eigen::Vector3d p_B = q_W_B_.conjugate() * boards_[board].p_W(t);
    return std::acos(std::min(1.0, (p_B - bearing.p_B_C).normalized().dot(bearing.u_B)));
  }

  CameraCalibration camera_ = camera();
  CameraModel model_ = *CameraModel::from(camera_);
  IdLibrary library_ = *IdLibrary::from(swarm());
  BlinkTracker tracker_{camera_, model_, VisionConfig{}, library_};
  std::vector<Board> boards_;
  std::vector<ExpectedBoard> expected_;
  double yaw_rate_radps_ = 0.0;
  double jitter_px_ = 0.2;
  Eigen::Quaterniond q_W_B_ = Eigen::Quaterniond::Identity();
  Timestamp now_{100s};
  SpotFrame frame_;
  std::mt19937 random_{5};
};

TEST_F(BlinkTrackerTest, GivesBearingsInBodyAxesAndBodyTime) {
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 1.0, 0.3); }}};
  for (int i = 0; i < 100; ++i) (void)step();

  std::vector<Bearing> bearings;
  while (bearings.empty()) bearings = step();

  ASSERT_EQ(bearings.size(), 1U);
  EXPECT_EQ(bearings[0].neighbor, RobotId{1});
  EXPECT_EQ(bearings[0].stamp, now_ + 2ms);
  EXPECT_LT((bearings[0].p_B_C - Eigen::Vector3d(0.06, 0.0, 0.01)).norm(), 1e-12);
  EXPECT_LT(error_of(bearings[0], 0), 5.0 * bearings[0].sigma_rad);
  EXPECT_NEAR(bearings[0].sigma_rad, 0.3 / 317.0, 0.4 / 317.0);
}

TEST_F(BlinkTrackerTest, ASpotThatJittersMoreThanConfiguredHasALargerSigma) {
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 1.0, 0.3); }}};
  const auto sigma_rad = [&](double jitter_px) {
    jitter_px_ = jitter_px;
    double last = 0.0;
    for (int i = 0; i < 600; ++i)
      for (const Bearing& bearing : step()) last = bearing.sigma_rad;
    return last;
  };

  const double as_configured = sigma_rad(0.1);

  EXPECT_NEAR(sigma_rad(0.5), 2.5 * as_configured, 0.5 * as_configured);
  EXPECT_NEAR(sigma_rad(0.1), as_configured, 0.01 * as_configured);
}

TEST_F(BlinkTrackerTest, KeepsItsBoardsWhileItTurnsFiveHundredDegreesASecond) {
  yaw_rate_radps_ = 500.0 / 57.29578;
  boards_ = {{0, [](double t) {  // an orbiting board stays in view
                const double a = 500.0 / 57.29578 * t;
                return Eigen::Vector3d(5.0 * std::cos(a), 5.0 * std::sin(a), 0.0);
              }}};
  for (int i = 0; i < 200; ++i) (void)step();
  // The same turn with boards that stand: in view for a sixth of a second or so at a time.
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 0.0, 0.0); }},
             {1, [](double) { return Eigen::Vector3d(0.0, 5.0, 1.0); }},
             {2, [](double) { return Eigen::Vector3d(-5.0, 0.0, -1.0); }}};

  int right = 0;
  for (int i = 0; i < 1200; ++i)
    for (const Bearing& bearing : step()) {
      const double error = error_of(bearing, bearing.neighbor.value - 1U);
      ASSERT_LT(error, 0.01);
      ++right;
    }

  EXPECT_GT(right, 100);
}

TEST_F(BlinkTrackerTest, DistinguishesCrossingBoards) {
  boards_ = {{0, [](double t) { return Eigen::Vector3d(5.0, -2.0 + 0.8 * t, 0.0); }},
             {1, [](double t) { return Eigen::Vector3d(5.0, 2.0 - 0.8 * t, 0.02); }}};
  int right = 0;
  for (int i = 0; i < 1000; ++i)
    for (const Bearing& bearing : step()) {
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.015) << "frame " << i;
      ++right;
    }

  EXPECT_GT(right, 1000);
  EXPECT_GT(tracker_.status().merged_spots, 0U);
}

TEST_F(BlinkTrackerTest, KeepsIdsWhileFramesAreLost) {
  yaw_rate_radps_ = 0.5;
  boards_ = {{0, [](double t) { return Eigen::Vector3d(5.0, 0.5 * t, 0.3); }},
             {1, [](double t) { return Eigen::Vector3d(5.0, 2.0 + 0.5 * t, 0.3); }}};
  for (int i = 0; i < 100; ++i) (void)step();
  std::size_t named = 0;
  std::size_t lit = 0;
  for (int i = 0; i < 300; ++i) {
    const bool is_lost = i % 60 < 18;  // 90 ms
    const auto bearings = step(is_lost);
    if (is_lost) continue;
    named += bearings.size();
    lit += frame_.spots.size();
    for (const Bearing& bearing : bearings)
      EXPECT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005);
  }

  EXPECT_GE(static_cast<double>(named), 0.9 * static_cast<double>(lit));
  EXPECT_EQ(tracker_.status().lost_ids, 0U);
}

TEST_F(BlinkTrackerTest, NamesABoardInItsFirstFrameAfterAGapThatTheGyroCarries) {
  for (const Duration gap : {400ms, 490ms}) {
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    yaw_rate_radps_ = 0.05;
    const double begin = to_seconds(now_.time_since_epoch()) - 100.0;
    const auto shown = [=](double t, double phase, const Eigen::Vector3d& p) {
      const double within = std::fmod(t - begin + phase, 1.2);
      return t - begin > 1.0 && within < to_seconds(gap) ? Eigen::Vector3d(-5.0, 0.0, 0.0) : p;
    };
    boards_ = {{0,
                [=](double t) {
                  return shown(t, 0.0, {5.0, 0.2 * (t - begin), 0.3});
                }},
               {1, [=](double t) {
                  return shown(t, 0.5, {5.0, 2.0 + 0.2 * (t - begin), 0.3});
                }}};
    std::size_t lit = 0;
    std::size_t predicted = 0;
    std::size_t read = 0;
    std::size_t confirmed = 0;
    for (int i = 0; i < 1200; ++i) {
      const auto bearings = step();
      if (i < 200) continue;
      lit += frame_.spots.size();
      confirmed += tracker_.confirmed().size();
      for (const Bearing& bearing : bearings) {
        ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "frame " << i;
        ++(bearing.how == Naming::kRead ? read : predicted);
      }
    }
    EXPECT_GE(static_cast<double>(read + predicted), 0.97 * static_cast<double>(lit));
    EXPECT_GT(predicted, 20U) << "they are marked";
    EXPECT_LT(predicted, lit / 4);
    EXPECT_NEAR(static_cast<double>(confirmed), static_cast<double>(predicted), 15.0);
    EXPECT_EQ(tracker_.status().lost_ids, 0U);
    EXPECT_EQ(tracker_.status().predicted_ids.unconfirmed, 0U);
  }
}

/// Board 1 flies 3 m while it is hidden for four seconds: the gyro does not know.
Eigen::Vector3d hidden_for_four_seconds(double t) {
  return t > 1.0 && t < 5.0 ? Eigen::Vector3d(-5.0, 0.0, 0.0)
                            : Eigen::Vector3d(5.0, t < 1.0 ? -1.5 : 1.5, 0.0);
}

TEST_F(BlinkTrackerTest, NamesABoardWhereAPoseExpectsIt) {
  for (const bool has_pose : {true, false}) {
    now_ = Timestamp{100s};
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    boards_ = {{0, hidden_for_four_seconds}};
    int to_name = 0;  // frames with light
    bool was_predicted = false;
    while (now_ < Timestamp{106s}) {
      expected_.clear();
      if (has_pose && now_ > Timestamp{105s}) expected_ = {pose_of(0)};
      const auto bearings = step();
      if (now_ < Timestamp{105s}) continue;
      if (bearings.empty() && !frame_.spots.empty()) ++to_name;
      if (bearings.empty()) continue;
      was_predicted = bearings[0].how == Naming::kPredicted;
      break;
    }
    EXPECT_EQ(was_predicted, has_pose);
    EXPECT_LE(to_name, has_pose ? 0 : 60);
    EXPECT_GE(to_name, has_pose ? 0 : 10);
  }
}

TEST_F(BlinkTrackerTest, DoesNotNameALightWhereThePoseExpectsNone) {
  const auto predicted_of = [&](std::vector<Board> boards, const Eigen::Vector3d& pose_off) {
    now_ = Timestamp{100s};
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    boards_ = std::move(boards);
    std::size_t predicted = 0;
    while (now_ < Timestamp{107s}) {
      expected_ = {pose_of(0)};
      expected_[0].p_B_M =
          Eigen::Vector3d(5.0, now_ < Timestamp{101s} ? -1.5 : 1.5, 0.0) + pose_off;
      for (const Bearing& bearing : step()) predicted += bearing.how == Naming::kPredicted ? 1 : 0;
    }
    return predicted;
  };
  const Board board{0, hidden_for_four_seconds};
  const Board lamp{3, [](double t) {  // from second 2 on
                     return Eigen::Vector3d(t < 2.0 ? -5.0 : 5.0, 1.55, 0.02);
                   }};

  EXPECT_GT(predicted_of({board}, Eigen::Vector3d::Zero()), 5U);
  EXPECT_EQ(predicted_of({board}, {0.0, 0.3, 0.0}), 0U) << "far from its gate";
  EXPECT_LT(predicted_of({board, lamp}, Eigen::Vector3d::Zero()), 40U)
      << "a lamp is named until the board would be dark, and the board beside it is not";
  EXPECT_GE(tracker_.status().predicted_ids.unconfirmed, 1U);
}

TEST_F(BlinkTrackerTest, DoesNotTakeALightBesideTheExpectedPlaceForTheBoardThatWasHidden) {
  // Board 2 appears 10 px beside the place where board 1 was 90 ms before.
  boards_ = {{0, [](double t) { return Eigen::Vector3d(t < 1.0 ? 5.0 : -5.0, 0.0, 0.0); }},
             {1, [](double t) { return Eigen::Vector3d(t < 1.09 ? -5.0 : 5.0, 0.16, 0.0); }}};
  for (int i = 0; i < 400; ++i)
    for (const Bearing& bearing : step())
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "frame " << i;
}

TEST_F(BlinkTrackerTest, RecognizesInGlimpsesWhatItHasSeenBefore) {
  // Each board shows itself for 144 ms, 0.8 of its pattern, and is hidden for 756 ms; the camera
  // turns, and they move.
  yaw_rate_radps_ = 0.1;
  const auto glimpsed = [](double t, double phase, const Eigen::Vector3d& p) {
    const double turns = t / 0.9 + phase;
    return turns - std::floor(turns) < 0.16 ? p : Eigen::Vector3d(-5.0, 0.0, 0.0);
  };
  boards_ = {{0,
              [&](double t) {
                return glimpsed(t, 0.0, {5.0, 0.6 * t, 0.3});
              }},
             {1, [&](double t) {
                return glimpsed(t, 0.4, {5.0, 0.6 * t + 3.0, 0.3});
              }}};
  std::size_t named = 0;
  std::size_t lit = 0;
  for (int i = 0; i < 1400; ++i) {
    const auto bearings = step();
    lit += frame_.spots.size();
    named += bearings.size();
    for (const Bearing& bearing : bearings)
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "frame " << i;
  }

  EXPECT_GT(static_cast<double>(named), 0.15 * static_cast<double>(lit));
}

TEST_F(BlinkTrackerTest, DoesNotTakeANewBoardForTheOneThatWasHiddenThere) {
  for (int trial = 0; trial < 60; ++trial) {
    tracker_ = BlinkTracker(camera_, model_, VisionConfig{}, library_);
    const double begin = to_seconds(now_.time_since_epoch()) - 100.0;
    const double shows = begin + 1.8 + 0.013 * trial;
    const auto shown = [](bool is_shown) {
      return Eigen::Vector3d(is_shown ? 5.0 : -5.0, 0.0, 0.0);
    };
    boards_ = {{0, [=](double t) { return shown(t < begin + 1.0); }},
               {1, [=](double t) { return shown(t >= shows); }}};
    int seen = 0;
    for (int i = 0; i < 900; ++i)
      for (const Bearing& bearing : step()) {
        ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.005) << "trial " << trial;
        seen += bearing.neighbor == RobotId{2} ? 1 : 0;
      }
    EXPECT_GT(seen, 150);
  }
}

TEST_F(BlinkTrackerTest, DeliversAMirrorImageBesideTheBoardItself) {
  boards_ = {{0, [](double) { return Eigen::Vector3d(5.0, 0.0, 0.5); }},
             {0, [](double) { return Eigen::Vector3d(5.0, 0.0, -2.0); }}};
  for (int i = 0; i < 200; ++i) (void)step();

  int both = 0;
  for (int i = 0; i < 100; ++i) both += step().size() == 2U ? 1 : 0;

  EXPECT_GT(both, 30);
}

TEST_F(BlinkTrackerTest, FindsRobotsAmongTwoHundredLamps) {
  boards_ = {{0, [](double t) { return Eigen::Vector3d(4.0, std::sin(t), 0.4); }},
             {1, [](double t) { return Eigen::Vector3d(3.0, 2.0, 0.3 * std::cos(t)); }}};
  for (int i = 0; i < 190; ++i) {
    const Eigen::Vector3d p(4.0, -4.5 + 0.5 * (i % 19), -2.5 + 0.6 * (i / 19));
    boards_.push_back({3, [p](double) { return p; }});
  }
  int right = 0;
  for (int i = 0; i < 400; ++i)
    for (const Bearing& bearing : step()) {
      ASSERT_LE(bearing.neighbor.value, 2);
      ASSERT_LT(error_of(bearing, bearing.neighbor.value - 1U), 0.02);
      ++right;
    }

  EXPECT_GT(right, 300);
  EXPECT_LE(tracker_.status().tracks, 512U);
}

TEST_F(BlinkTrackerTest, DoesNotCareForTheOrderOfSpots) {
  BlinkTracker twin(camera_, model_, VisionConfig{}, library_);
  boards_ = {{0, [](double t) { return Eigen::Vector3d(5.0, -1.0 + t, 0.0); }},
             {1, [](double t) { return Eigen::Vector3d(5.0, 1.0 - t, 0.1); }},
             {2, [](double) { return Eigen::Vector3d(5.0, 0.0, 0.5); }}};
  for (int i = 0; i < 500; ++i) {
    const std::vector<Bearing> bearings = step();
    std::reverse(frame_.spots.begin(), frame_.spots.end());
    ImuSample imu;
    imu.stamp = now_ + 2ms;
    twin.add_imu(imu);
    const std::vector<Bearing> mirrored = twin.step(frame_);

    ASSERT_EQ(bearings.size(), mirrored.size());
    for (std::size_t k = 0; k < bearings.size(); ++k) {
      ASSERT_EQ(bearings[k].neighbor, mirrored[k].neighbor);
      ASSERT_EQ(bearings[k].u_B, mirrored[k].u_B);
    }
  }
}

TEST_F(BlinkTrackerTest, RefusesAndCountsWhatMakesNoSense) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  SpotFrame frame;
  frame.stamp = now_;
  frame.spots = {{kNan, 10.0, 5.0, 255.0}, {640.0, 512.0, kNan, 255.0}, {1e9, 0.0, 5.0, 255.0}};
  ImuSample imu;
  imu.stamp = now_;
  imu.gyro_radps.x() = kNan;

  (void)tracker_.step(frame);
  (void)tracker_.step(frame);
  tracker_.add_imu(imu);

  const TrackerStatus status = tracker_.status();
  EXPECT_EQ(status.refused_spots, 3U);
  EXPECT_EQ(status.refused_frames, 1U);
  EXPECT_EQ(status.refused_imu, 1U);
  EXPECT_EQ(status.tracks, 0U);
}

/// A board that shines always but in one slot, seen by a camera that turns to and fro by up to 2.6
/// rad/s. Rows are exposed one after the other, or all at once if `row_us` is 0. `configured_us` is
/// the tracker's setting. Returns the root mean square error of the bearings [px].
double error_of_a_turning_camera(double row_us, double configured_us, std::uint32_t seed) {
  constexpr double kTurn = 2.6;
  constexpr double kPace = 4.0;  // rad/s
  constexpr double kNoise = 0.03;
  CameraCalibration config = BlinkTrackerTest::camera();
  config.T_cam_imu.p.setZero();
  config.rolling_shutter_us_per_row = configured_us;
  const CameraModel model = *CameraModel::from(config);
  const IdLibrary library = *IdLibrary::from(BlinkTrackerTest::swarm());
  BlinkTracker tracker(config, model, VisionConfig{}, library);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, kNoise);
  const double height = std::uniform_real_distribution<double>(0.3, 0.7)(random);
  const Eigen::Vector3d u_W = Eigen::Vector3d(1.0, 0.1, seed % 2 == 0 ? height : -height);
  const auto u_B = [&](double t) {
    const double yaw = kTurn / kPace * std::sin(kPace * t);
    return Eigen::Vector3d(Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitZ()) * u_W.normalized());
  };
  double sum = 0.0;
  int count = 0;
  for (double t = 0.0; t < 3.0; t += 0.005) {
    ImuSample imu;
    imu.stamp = Timestamp{from_seconds(100.002 + t)};
    imu.gyro_radps.z() = kTurn * std::cos(kPace * (t - 0.0025));
    tracker.add_imu(imu);
    double exposed = t;
    for (int round = 0; round < 3; ++round)
      exposed = t + 1e-6 * row_us *
                        (model.project(config.T_cam_imu.q * u_B(exposed))->y() -
                         0.5 * (model.height() - 1));
    SpotFrame frame{.stamp = Timestamp{from_seconds(100.0 + t)}, .camera = 0, .spots = {}};
    if (library.entries()[0].code.is_lit(from_seconds(200.002 + exposed))) {
      const Eigen::Vector2d uv = *model.project(config.T_cam_imu.q * u_B(exposed));
      frame.spots.push_back({uv.x() + noise(random), uv.y() + noise(random), 12.0, 255.0});
    }
    for (const Bearing& bearing : tracker.step(frame)) {
      sum += (*model.project(config.T_cam_imu.q * bearing.u_B) -
              *model.project(config.T_cam_imu.q * u_B(t)))
                 .squaredNorm();
      ++count;
    }
  }
  EXPECT_GT(count, 250) << "of some 600 frames";
  return std::sqrt(sum / count);
}

TEST(BlinkTracker, TurnsWhatARollingShutterSawToTheStampOfTheFrame) {
  for (std::uint32_t seed = 1; seed <= 8; ++seed) {
    const double global = error_of_a_turning_camera(0.0, 0.0, seed);

    EXPECT_LT(error_of_a_turning_camera(4.4, 4.4, seed), 1.1 * global) << "seed " << seed;
    EXPECT_LT(error_of_a_turning_camera(-4.4, -4.4, seed), 1.1 * global) << "bottom row first";
    EXPECT_GT(error_of_a_turning_camera(4.4, 0.0, seed), 5.0 * global) << "it is not configured";
    EXPECT_GT(error_of_a_turning_camera(4.4, -4.4, seed), 10.0 * global) << "the wrong way round";
  }
}

}  // namespace
}  // namespace crepes::blink_tracker_test
