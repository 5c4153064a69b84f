#include "estimator/core/so3.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::so3_test {
namespace {

using test::largest_difference;
using test::numeric_jacobian;
using test::RandomGeometry;

constexpr double kPi = std::numbers::pi;

/// Largest error of log(exp(theta)) over random axes at this angle.
double round_trip_error(double angle) {
  RandomGeometry random(1);
  double worst = 0.0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d theta = angle * random.direction();
    worst = std::max(worst, (so3_log(so3_exp(theta)) - theta).norm());
  }
  return worst;
}

TEST(So3, LogUndoesExpToRoundingFromZeroToPi) {
  EXPECT_EQ(round_trip_error(0.0), 0.0);
  EXPECT_LT(round_trip_error(1e-12), 1e-27);
  EXPECT_LT(round_trip_error(1e-6), 1e-20);
  EXPECT_LT(round_trip_error(0.999e-3), 1e-17);  // both sides of the switch from series to sine
  EXPECT_LT(round_trip_error(1.001e-3), 1e-17);
  EXPECT_LT(round_trip_error(2.001e-3), 1e-17);
  EXPECT_LT(round_trip_error(1.0), 1e-14);
  EXPECT_LT(round_trip_error(kPi - 1e-3), 1e-14);
  EXPECT_LT(round_trip_error(kPi - 1e-9), 1e-14);
}

TEST(So3, LogAtPiIsPiAboutTheAxisUpToItsSign) {
  RandomGeometry random(2);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d theta = kPi * random.direction();

    const Eigen::Vector3d log = so3_log(so3_exp(theta));

    EXPECT_LT(std::min((log - theta).norm(), (log + theta).norm()), 1e-14);
  }
}

TEST(So3, LogTakesTheShortWayForEitherSignOfTheQuaternion) {
  RandomGeometry random(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Quaterniond q = random.rotation();
    const Eigen::Quaterniond minus_q(-q.coeffs());

    EXPECT_LE(so3_log(q).norm(), kPi + 1e-14);
    EXPECT_LT((so3_log(q) - so3_log(minus_q)).norm(), 1e-14);
  }
}

TEST(So3, ExpTurnsAsTheMatrixExponentialSays) {
  const Eigen::Quaterniond quarter = so3_exp({0.0, 0.0, kPi / 2});

  EXPECT_LT((quarter * Eigen::Vector3d::UnitX() - Eigen::Vector3d::UnitY()).norm(), 1e-15);
}

TEST(So3, HatIsTheCrossProduct) {
  RandomGeometry random(4);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d v = random.vector();
    const Eigen::Vector3d w = random.vector();

    EXPECT_LT((hat(v) * w - v.cross(w)).norm(), 1e-14);
  }
}

/// Largest difference between the right Jacobian and differences of Exp at this angle.
double right_jacobian_error(double angle) {
  RandomGeometry random(5);
  double worst = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d theta = angle * random.direction();
    const Eigen::Quaterniond q_inv = so3_exp(theta).conjugate();
    const auto J = numeric_jacobian<3, 3>(
        [&](const Eigen::Vector3d& d) { return so3_log(q_inv * so3_exp(theta + d)); });
    worst = std::max(worst, largest_difference(so3_right_jacobian(theta), J));
  }
  return worst;
}

TEST(So3, RightJacobianIsTheDerivativeOfExp) {
  EXPECT_LT(right_jacobian_error(0.0), 1e-9);
  EXPECT_LT(right_jacobian_error(0.9e-3), 1e-9);
  EXPECT_LT(right_jacobian_error(1.1e-3), 1e-9);
  EXPECT_LT(right_jacobian_error(1.0), 1e-9);
  EXPECT_LT(right_jacobian_error(kPi), 1e-9);
  EXPECT_LT(right_jacobian_error(5.0), 1e-9);
}

/// Largest difference between the inverse Jacobian and differences of Log at this angle.
double inverse_jacobian_error(double angle) {
  RandomGeometry random(6);
  double worst = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d theta = angle * random.direction();
    const Eigen::Quaterniond q = so3_exp(theta);
    const auto J =
        numeric_jacobian<3, 3>([&](const Eigen::Vector3d& d) { return so3_log(q * so3_exp(d)); });
    worst = std::max(worst, largest_difference(so3_right_jacobian_inverse(theta), J));
  }
  return worst;
}

TEST(So3, InverseJacobianIsTheDerivativeOfLogUpToPi) {
  EXPECT_LT(inverse_jacobian_error(0.0), 1e-9);
  EXPECT_LT(inverse_jacobian_error(0.9e-3), 1e-9);
  EXPECT_LT(inverse_jacobian_error(1.1e-3), 1e-9);
  EXPECT_LT(inverse_jacobian_error(1.0), 1e-9);
  EXPECT_LT(inverse_jacobian_error(kPi - 1e-3), 1e-9);
}

TEST(So3, TheTwoJacobiansAreEachOthersInverse) {
  RandomGeometry random(7);
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d theta = random.uniform(0.0, kPi) * random.direction();

    const Eigen::Matrix3d product = so3_right_jacobian(theta) * so3_right_jacobian_inverse(theta);

    EXPECT_LT(largest_difference(product, Eigen::Matrix3d::Identity()), 1e-12);
  }
}

TEST(So3, ShortestRotationTurnsOneDirectionIntoTheOther) {
  RandomGeometry random(2);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d a = random.direction();
    const Eigen::Vector3d b = i % 4 == 0 ? Eigen::Vector3d(-a) : random.direction();
    const Eigen::Quaterniond q = shortest_rotation(2.0 * a, 3.0 * b);
    EXPECT_NEAR(q.norm(), 1.0, 1e-12);
    EXPECT_LT((q * a - b).norm(), 1e-6);
    EXPECT_NEAR(so3_log(q).norm(), std::acos(std::clamp(a.dot(b), -1.0, 1.0)), 1e-6);
  }
}

TEST(So3, AnglesAcrossAreTheTurnFromOneDirectionToAnother) {
  RandomGeometry random(8);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d from = random.direction();
    const Eigen::Matrix<double, 3, 2> across = tangent_basis(from);
    const Eigen::Vector2d angles = random.vector(i % 4 == 0 ? 1e-12 : 0.5).head<2>();
    const Eigen::Vector3d axis = from.cross(across * angles);

    EXPECT_LT((angles_across(from, across, so3_exp(axis) * from) - angles).norm(), 1e-12);
  }
}

TEST(So3, TangentBasisCompletesADirectionToARightHandedFrame) {
  RandomGeometry random(9);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d u = random.direction();
    const Eigen::Matrix<double, 3, 2> basis = tangent_basis(u);

    Eigen::Matrix3d frame;
    frame << basis, u;

    EXPECT_LT(largest_difference(frame.transpose() * frame, Eigen::Matrix3d::Identity()), 1e-14);
    EXPECT_NEAR(frame.determinant(), 1.0, 1e-14);
  }
}

TEST(So3, AngleBetweenIsExactNearZeroAndNearPi) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  for (const double angle : {1e-12, 1.0, kPi - 1e-12})
    EXPECT_NEAR(angle_between(x, 3.0 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0)),
                angle, 1e-15);
}

TEST(So3, TangentBasisHoldsAtBothPoles) {
  for (const double z : {1.0, -1.0}) {
    const Eigen::Vector3d u(0.0, 0.0, z);
    const Eigen::Matrix<double, 3, 2> basis = tangent_basis(u);

    EXPECT_TRUE(basis.allFinite());
    EXPECT_NEAR(basis.col(0).cross(basis.col(1)).dot(u), 1.0, 1e-15);
  }
}

}  // namespace
}  // namespace crepes::so3_test
