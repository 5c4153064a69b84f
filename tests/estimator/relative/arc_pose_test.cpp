#include "estimator/relative/arc_pose.hpp"

#include <gtest/gtest.h>

#include "tests/support/random_geometry.hpp"

namespace crepes::arc_pose_test {
namespace {

constexpr int kDraws = 20000;

/// Three meters away, to a centimeter; the heading of B to `heading_rad`.
GaussianPose seen(double heading_rad) {
  Vector6d sigma;
  sigma << 0.01, 0.01, 0.01, 0.005, 0.005, heading_rad;
  return {{{3.0, 0.4, -0.2}, so3_exp({0.1, -0.2, 1.0})}, sigma.cwiseAbs2().asDiagonal()};
}

/// Mean and covariance of the inverses of draws, and the share of their positions that are beyond
/// five sigma of `said`.
struct Drawn {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double beyond = 0.0;
};
Drawn drawn(const GaussianPose& T_A_B, const GaussianPose& said) {
  test::RandomGeometry random(1);
  const Eigen::Matrix3d information = said.covariance.topLeftCorner<3, 3>().inverse();
  Drawn result;
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Pose T_B_A = perturbed(T_A_B.pose, random.draw<6>(T_A_B.covariance)).inverse();
    const Eigen::Vector3d e = T_B_A.p - said.pose.p;
    result.mean += T_B_A.p / kDraws;
    moment += e * e.transpose() / kDraws;
    if (e.dot(information * e) > 35.0) result.beyond += 1.0 / kDraws;
  }
  const Eigen::Vector3d bias = result.mean - said.pose.p;
  result.covariance = moment - bias * bias.transpose();
  return result;
}

TEST(ArcPose, IsTheInverseWhereTheHeadingIsKnown) {
  const GaussianPose said = inverse_on_arc(seen(1e-4));
  const GaussianPose tangent = inverse(seen(1e-4));

  EXPECT_LT(pose_difference(tangent.pose, said.pose).norm(), 1e-4);
  EXPECT_LT((said.covariance - tangent.covariance).norm(), 1e-4 * tangent.covariance.norm());
}

TEST(ArcPose, IsInTheMiddleOfTheArcAndAsUncertain) {
  for (const double heading_rad : {0.05, 0.15, 0.3}) {
    const GaussianPose said = inverse_on_arc(seen(heading_rad));
    const Drawn truth = drawn(seen(heading_rad), said);
    const double bend = 1.5 * heading_rad * heading_rad;  // of 3 m
    EXPECT_LT((truth.mean - said.pose.p).norm(), 0.02 * bend + 0.01) << heading_rad;

    const Eigen::Vector3d along = said.pose.p.normalized();
    const double sigma = std::sqrt(along.dot(truth.covariance * along));
    const double sigma_said = std::sqrt(along.dot(said.covariance.topLeftCorner<3, 3>() * along));
    EXPECT_GT(sigma_said, 0.97 * sigma) << heading_rad;
    EXPECT_LT(sigma_said, 1.5 * sigma) << heading_rad;
  }
}

TEST(ArcPose, HoldsAllButOneArcInAThousand) {
  for (const double heading_rad : {0.05, 0.15, 0.3}) {
    EXPECT_LT(drawn(seen(heading_rad), inverse_on_arc(seen(heading_rad))).beyond, 0.0015);
  }
  EXPECT_GT(drawn(seen(0.15), inverse(seen(0.15))).beyond, 0.1);  // the tangent
}

}  // namespace
}  // namespace crepes::arc_pose_test
