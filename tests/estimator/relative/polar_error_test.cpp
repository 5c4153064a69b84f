#include "estimator/relative/polar_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/core/so3.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::polar_error_test {
namespace {

using test::largest_difference;
using test::numeric_jacobian;
using test::RandomGeometry;
using E = ErrorState;

constexpr int kMotions = 300;

/// No closer than 0.5 m, where the step of a difference turns the line of sight by 2e-5 rad.
RelativeMotion random_motion(RandomGeometry& random) {
  RelativeMotion motion{random.pose(), random.vector()};
  motion.T_B_N.p += 0.5 * motion.T_B_N.p.normalized();
  return motion;
}

/// After a correction that turns the line of sight by up to a radian.
RelativeMotion near(const RelativeMotion& motion, RandomGeometry& random) {
  const Eigen::Vector3d p = so3_exp(random.uniform(0.0, 1.0) * random.direction()) * motion.T_B_N.p;
  return {{random.uniform(0.5, 2.0) * p,
           motion.T_B_N.q * so3_exp(random.uniform(0.0, 1.0) * random.direction())},
          motion.v_B_N + random.vector()};
}

RelativeMotion added(const RelativeMotion& motion, const MotionError& dx) {
  return {
      {motion.T_B_N.p + dx.segment<3>(E::kP), motion.T_B_N.q * so3_exp(dx.segment<3>(E::kTheta))},
      motion.v_B_N + dx.segment<3>(E::kV)};
}

MotionError difference(const RelativeMotion& from, const RelativeMotion& to) {
  MotionError dx;
  dx << to.T_B_N.p - from.T_B_N.p, to.v_B_N - from.v_B_N,
      so3_log(from.T_B_N.q.conjugate() * to.T_B_N.q);
  return dx;
}

/// A motion against another in polar coordinates, along the axes of the other's line of sight.
struct Polar {
  double log_distance;
  Eigen::Vector3d turn;      ///< of the line of sight
  Eigen::Vector3d velocity;  ///< over distance, in axes that turn
  Eigen::Vector3d attitude;  ///< beyond that turn, in N's axes
};

Polar polar(const RelativeMotion& from, const RelativeMotion& to) {
  const double rho = to.T_B_N.p.norm();
  const Eigen::Quaterniond turn = shortest_rotation(from.T_B_N.p, to.T_B_N.p);
  return {std::log(rho / from.T_B_N.p.norm()), so3_log(turn),
          turn.conjugate() * to.v_B_N / rho - from.v_B_N / from.T_B_N.p.norm(),
          so3_log(from.T_B_N.q.conjugate() * turn.conjugate() * to.T_B_N.q)};
}

RelativeMotion moved(const RelativeMotion& from, const Polar& by) {
  const double rho = from.T_B_N.p.norm() * std::exp(by.log_distance);
  const Eigen::Quaterniond turn = so3_exp(by.turn);
  return {{rho * (turn * from.T_B_N.p.normalized()), turn * from.T_B_N.q * so3_exp(by.attitude)},
          rho * (turn * (from.v_B_N / from.T_B_N.p.norm() + by.velocity))};
}

TEST(PolarError, ACorrectionIsAnAdditionToFirstOrder) {
  RandomGeometry random(1);
  for (int i = 0; i < kMotions; ++i) {
    const RelativeMotion motion = random_motion(random);
    const auto by_dx = numeric_jacobian<E::kMotion, E::kMotion>(
        [&](const MotionError& dx) { return difference(motion, corrected(motion, dx)); });
    EXPECT_LT(largest_difference(by_dx, MotionTransport::Identity()), 1e-8);
  }
}

TEST(PolarError, ALargeCorrectionTurnsTheLineOfSightAsFarAsItSays) {
  const RelativeMotion motion{{{4.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, {0.0, 1.0, 0.0}};
  MotionError dx = MotionError::Zero();
  dx.segment<3>(E::kP) << 1.0, 4.0 * 1.2, 0.0;

  const RelativeMotion there = corrected(motion, dx);

  EXPECT_NEAR(angle_between(there.T_B_N.p, motion.T_B_N.p), 1.2, 1e-12);
  EXPECT_NEAR(there.T_B_N.p.norm(), 5.0, 1e-12);
  // Where N sees B, it turns alike: what dx does not say of the attitude stays.
  EXPECT_NEAR(so3_log(there.T_B_N.q).norm(), 0.0, 1e-12);
}

TEST(PolarError, ACorrectionNeverReachesTheOrigin) {
  const RelativeMotion motion{{{2.0, 0.0, 0.0}, Eigen::Quaterniond::Identity()}, {}};
  MotionError dx = MotionError::Zero();
  dx(E::kP) = -7.0;
  EXPECT_NEAR(corrected(motion, dx).T_B_N.p.x(), 0.2, 1e-12);
  EXPECT_EQ(corrected({}, dx).T_B_N.p.x(), -7.0);
}

TEST(PolarError, TransportIsTheDerivativeBetweenEqualPolarErrors) {
  RandomGeometry random(2);
  for (int i = 0; i < kMotions; ++i) {
    const RelativeMotion before = random_motion(random);
    const RelativeMotion after = near(before, random);
    const Eigen::Quaterniond turn = shortest_rotation(before.T_B_N.p, after.T_B_N.p);
    const Eigen::Quaterniond turn_N = shortest_rotation(before.T_B_N.q.conjugate() * before.T_B_N.p,
                                                        after.T_B_N.q.conjugate() * after.T_B_N.p);

    const auto numeric =
        numeric_jacobian<E::kMotion, E::kMotion>([&](const MotionError& dx) -> MotionError {
          Polar error = polar(before, added(before, dx));
          error.turn = turn * error.turn;
          error.velocity = turn * error.velocity;
          error.attitude = turn_N * error.attitude;
          return difference(after, moved(after, error));
        });

    EXPECT_LT(largest_difference(error_transport(before, after), numeric), 1e-7);
  }
}

// What bearings of both robots do not observe: distance with speed, roll about the line of sight.
TEST(PolarError, WhatBearingsDoNotObserveStaysSo) {
  RandomGeometry random(3);
  const auto unobserved = [](const RelativeMotion& motion) {
    Eigen::Matrix<double, E::kMotion, 2> directions = Eigen::Matrix<double, E::kMotion, 2>::Zero();
    directions.col(0) << motion.T_B_N.p, motion.v_B_N, Eigen::Vector3d::Zero();
    directions.col(1).segment<3>(E::kTheta) =
        motion.T_B_N.q.conjugate() * motion.T_B_N.p.normalized();
    return directions;
  };
  for (int i = 0; i < kMotions; ++i) {
    const RelativeMotion before = random_motion(random);
    const RelativeMotion after = near(before, random);
    EXPECT_LT(
        largest_difference(error_transport(before, after) * unobserved(before), unobserved(after)),
        1e-12);
  }
}

TEST(PolarError, TheAttitudeOfARobotThatSeesNothingKeepsItsError) {
  RandomGeometry random(5);
  for (int i = 0; i < kMotions; ++i) {
    const RelativeMotion before = random_motion(random);
    const RelativeMotion after = near(before, random);
    const MotionTransport T = error_transport_of_blind(before, after);
    const MotionTransport seeing = error_transport(before, after);
    EXPECT_EQ(T.middleRows<3>(E::kTheta), MotionTransport::Identity().middleRows<3>(E::kTheta));
    EXPECT_EQ(T.topRows<6>(), seeing.topRows<6>());
  }
}

}  // namespace
}  // namespace crepes::polar_error_test
