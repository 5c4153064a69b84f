#include "estimator/team/readings/team_measurement.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "estimator/core/so3.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::team_measurement_test {
namespace {

using test::RandomGeometry;

constexpr double kDuration = 0.1;  // s
constexpr double kTime = 0.06;     // s; a point of the trajectories' grid
constexpr double kStep = 1e-6;
constexpr int kPerRobot = FreeMotionAt::kMotion + TeamRobot::kCalibration;
constexpr int kCamera = 2 * kPerRobot;
constexpr int kRangeBias = kCamera + TeamCamera::kStates;

/// Two robots with random motions, and everything that a measurement between them depends on.
struct Scene {
  explicit Scene(RandomGeometry& random) {
    for (int i = 0; i < 2; ++i) {
      TeamRobot& robot = robots.at(std::size_t(i));
      robot.motion = {random.vector(0.5) + Eigen::Vector3d(4.0 * i, 0.0, 0.0), random.vector(1.0),
                      random.rotation()};
      robot.motion_index = i * kPerRobot;
      robot.bias_index = i * kPerRobot + FreeMotionAt::kMotion;
      TeamMember& member = members.at(std::size_t(i));
      member.p_body_led = random.vector(0.1);
      member.p_body_uwb = random.vector(0.1);
      member.imu.resize(10);
      for (ImuMean& mean : member.imu) {
        mean.gyro_radps = random.vector(2.0);
        mean.accel_mps2 = Eigen::Vector3d(0.0, 0.0, 9.81) + random.vector(2.0);
      }
      member.imu[6].gyro_radps = member.imu[5].gyro_radps;  // LEDs do not jerk at kTime
    }
    camera.p_B_C = random.vector(0.1);
    camera.misalignment = random.vector(0.1);
    camera.lens = random.vector(6e-4);
    camera.index = kCamera;
    bias.bias_m = 0.1;
    bias.index = kRangeBias;
  }

  void perturb(int state, double by) {
    if (state >= kCamera) {
      (state == kRangeBias           ? bias.bias_m
       : state < camera.lens_index() ? camera.misalignment(state - kCamera)
                                     : camera.lens(state - camera.lens_index())) += by;
      return;
    }
    TeamRobot& robot = robots.at(std::size_t(state / kPerRobot));
    const int i = state % kPerRobot;
    if (i < 3) robot.motion.p_F(i) += by;
    if (i >= 3 && i < 6) robot.motion.v_F(i - 3) += by;
    if (i >= 6 && i < 9)
      robot.motion.q_F_B = robot.motion.q_F_B * so3_exp(by * Eigen::Vector3d::Unit(i - 6));
    if (i >= 9 && i < 12) robot.bias.gyro_radps(i - 9) += by;
    if (i >= 12 && i < 15) robot.bias.accel_mps2(i - 12) += by;
    if (i == kPerRobot - 2) robot.antenna_delay_m += by;
    if (i == kPerRobot - 1) robot.clock_s += by;
    if (i >= 15 && i < kPerRobot - 2)
      robot.bias.gyro_scale.reshaped<Eigen::ColMajor>()(i - 15) += by;
  }

  /// Calls `f` with the pair as it is now.
  template <class F>
  auto with_pair(const F& f) const {
    const auto path = [&](std::size_t i) {
      return RobotTrajectory(robots.at(i).motion, robots.at(i).bias, members.at(i).imu, kDuration,
                             {});
    };
    const RobotTrajectory first = path(0);
    const RobotTrajectory second = path(1);
    // The instant is the beginning, so that it has the belief's motions.
    InstantStates states;
    states.of_belief.resize(kRangeBias + 1);
    std::iota(states.of_belief.begin(), states.of_belief.end(), 0);
    return f(TeamPair{robots[0], robots[1], members[0], members[1], first, second, states});
  }

  std::array<TeamRobot, 2> robots;
  std::array<TeamMember, 2> members;
  TeamCamera camera;
  TeamRangeBias bias;
};

/// The bearing that the scene's camera would report without noise.
Eigen::Vector3d true_bearing(const Scene& scene, const TeamPair& pair, double t_s) {
  const FreeMotion from = pair.observer_path.motion_at(t_s);
  const FreeMotion to =
      pair.neighbor_path.motion_at(t_s + pair.neighbor.clock_s - pair.observer.clock_s);
  const Eigen::Vector3d p_F_led = to.p_F + to.q_F_B * pair.neighbor_member.p_body_led;
  const Eigen::Vector3d d = from.q_F_B.conjugate() * (p_F_led - from.p_F) - scene.camera.p_B_C;
  return scene.camera.seen(d.normalized());
}

/// By each state, of what `f` measures of a scene.
template <class F>
void expect_derivatives(const Scene& scene, const TeamRow& row, const F& f) {
  for (int a = 0; a < row.size; ++a) {
    const int state = row.columns.at(std::size_t(a));
    Scene plus = scene;
    Scene minus = scene;
    plus.perturb(state, kStep);
    minus.perturb(state, -kStep);
    const Eigen::Vector2d numeric = (f(plus) - f(minus)) / (2.0 * kStep);
    // The grid's position is of second order in its step, so it is not quite the velocity's
    // integral.
    const bool is_clock = state < kCamera && state % kPerRobot == kPerRobot - 1;
    EXPECT_LT((numeric - row.H.col(a)).head(row.dimension).norm(), is_clock ? 1e-3 : 2e-6)
        << "state " << state;
  }
}

TEST(TeamMeasurement, DerivativesOfABearingAreThoseOfItsResidual) {
  RandomGeometry random(1);
  for (int i = 0; i < 20; ++i) {
    const Scene scene(random);
    const auto model_of = [&](const Scene& s) {
      return s.with_pair([&](const TeamPair& pair) {
        return SightModel::at(pair, s.camera, kTime, 1e-3).value();
      });
    };
    const SightModel model = model_of(scene);
    const auto bearing_of = [&](const Scene& s) {
      return s.with_pair([&](const TeamPair& pair) { return true_bearing(s, pair, kTime); });
    };
    const Eigen::Vector3d u = bearing_of(scene);
    const Eigen::Matrix<double, 3, 2> across = tangent_basis(u);
    expect_derivatives(scene, model.row(), [&](const Scene& s) -> Eigen::Vector2d {
      return across.transpose() * bearing_of(s);
    });
    const auto residual = scene.with_pair(
        [&](const TeamPair& pair) { return model.residual(pair, scene.camera, u, kTime); });
    ASSERT_TRUE(residual.has_value());
    EXPECT_LT(residual->norm(), 1e-9);
  }
}

// A bearing that was taken earlier in the interval has the residual that it would have at the row.
TEST(TeamMeasurement, ABearingOfAnotherInstantIsTurnedToTheRow) {
  RandomGeometry random(2);
  for (int i = 0; i < 20; ++i) {
    const Scene scene(random);
    for (const double t_s : {0.0, 0.033, 0.1}) {
      scene.with_pair([&](const TeamPair& pair) {
        const SightModel model = SightModel::at(pair, scene.camera, kTime, 1e-3).value();
        const Eigen::Vector3d u = true_bearing(scene, pair, t_s);
        const Eigen::Vector3d error = 0.01 * tangent_basis(u).col(0);
        const auto residual = model.residual(pair, scene.camera, so3_exp(error) * u, t_s);
        ASSERT_TRUE(residual.has_value());
        EXPECT_NEAR(residual->norm(), 0.01, 1e-6);
        EXPECT_FALSE(model.residual(pair, scene.camera, -u, t_s).has_value());
      });
    }
  }
}

TEST(TeamMeasurement, DerivativesOfARangeAreThoseOfItsResidual) {
  RandomGeometry random(3);
  for (int i = 0; i < 20; ++i) {
    const Scene scene(random);
    const auto row_of = [&](const Scene& s) {
      return s.with_pair([&](const TeamPair& pair) {
        return range_row(pair, s.bias, {5.0, 0.1}, kTime, RelativeSpread{}).value();
      });
    };
    expect_derivatives(scene, row_of(scene), [&](const Scene& s) -> Eigen::Vector2d {
      return {-row_of(s).residual.x(), 0.0};
    });
  }
}

// What a range says of a direction that is not known is no more than the second order allows.
TEST(TeamMeasurement, ARangeAboutAnUnknownDirectionCountsLess) {
  RandomGeometry random(4);
  const Scene scene(random);
  scene.with_pair([&](const TeamPair& pair) {
    const TeamRow known = range_row(pair, scene.bias, {5.0, 0.1}, kTime, RelativeSpread{}).value();
    const TeamRow unknown = range_row(pair, scene.bias, {5.0, 0.1}, kTime,
                                      RelativeSpread{.covariance = Eigen::Matrix3d::Identity()})
                                .value();
    EXPECT_GT(unknown.variance, 2.0 * known.variance);
    EXPECT_LT(unknown.residual.x(), known.residual.x());
  });
}

}  // namespace
}  // namespace crepes::team_measurement_test
