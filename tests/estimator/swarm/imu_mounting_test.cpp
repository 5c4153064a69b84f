// Robots whose IMU is not mounted as configured.
#include "estimator/swarm/imu_mounting.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "estimator/core/so3.hpp"
#include "tests/support/estimator_pair.hpp"

namespace crepes::imu_mounting_test {
namespace {

using namespace std::chrono_literals;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::Conditions;
using test::EstimatorPair;

constexpr double kRightAngle = 0.5 * std::numbers::pi;
constexpr double kStep_s = 0.1;

/// A robot that sways and turns, and neighbors that move about it.
class Swaying {
 public:
  Swaying(unsigned seed, const Matrix3d& R_imu_body) : random_(seed), R_(R_imu_body) {
    for (Vector3d& p : neighbors_) p = 4.0 * any().normalized();
  }

  /// How many of the neighbors it sees.
  void observe(std::size_t visible, double seconds, MountingEvidence& evidence) {
    for (int i = 0; i < static_cast<int>(seconds / kStep_s); ++i) {
      const Eigen::Quaterniond before = q_W_B_;
      rate_ += 0.2 * (0.4 * any() - rate_);
      const Vector3d theta = kStep_s * rate_;
      q_W_B_ = (before * so3_exp(theta)).normalized();
      const Vector3d up = (q_W_B_.conjugate() * Vector3d::UnitZ() + 0.1 * any()).normalized();
      for (std::size_t k = 0; k < visible; ++k) {
        const Vector3d from = neighbors_.at(k);
        neighbors_.at(k) += kStep_s * 0.3 * any();
        const Vector3d u = noisy(q_W_B_.conjugate() * neighbors_.at(k));
        evidence.add_turn(noisy(before.conjugate() * from), u, R_ * theta);
        evidence.add_elevation(u, R_ * up, -neighbors_.at(k).normalized().z() + 0.05 * normal());
      }
    }
  }

 private:
  double normal() { return std::normal_distribution<double>()(random_); }
  Vector3d any() { return {normal(), normal(), normal()}; }
  Vector3d noisy(const Vector3d& p) { return (p.normalized() + 0.002 * any()).normalized(); }

  std::mt19937_64 random_;
  Matrix3d R_;
  std::array<Vector3d, 3> neighbors_;
  Eigen::Quaterniond q_W_B_ = Eigen::Quaterniond::Identity();
  Vector3d rate_ = Vector3d::Zero();
};

Matrix3d about(const Vector3d& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

TEST(MountingEvidence, FindsTheRotation) {
  const std::array rotations{about(Vector3d::UnitX(), std::numbers::pi),
                             about(Vector3d::UnitZ(), std::numbers::pi),
                             about(Vector3d::UnitX(), kRightAngle),
                             about(Vector3d::UnitZ(), -kRightAngle),
                             about({1.0, 1.0, 1.0}, 2.0 * std::numbers::pi / 3.0),
                             about({1.0, -0.4, 0.3}, 1.3)};
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Matrix3d& R_imu_body = rotations.at(seed % rotations.size());
    MountingEvidence evidence;
    Swaying(seed, R_imu_body).observe(seed % 3 + 1, 10.0, evidence);
    const auto found = evidence.rotation();
    ASSERT_TRUE(found) << seed;
    EXPECT_LT(Eigen::AngleAxisd(*found * R_imu_body).angle(), 0.3) << seed;
  }
}

TEST(MountingEvidence, FindsNoneWhereThereIsNone) {
  for (unsigned seed = 0; seed < 300; ++seed) {
    MountingEvidence evidence;
    Swaying robot(seed, Matrix3d::Identity());
    for (int i = 0; i < 20; ++i) {
      robot.observe(seed % 3 + 1, 0.5, evidence);
      ASSERT_FALSE(evidence.rotation()) << seed << " after " << 0.5 * i << " s";
    }
  }
}

/// In a convoy that takes a bend, whoever is ahead stays ahead. As if the IMU lay on its side, and
/// read a roll as yaw; but then up would be ahead.
TEST(MountingEvidence, IsNotMisledByACommonTurn) {
  MountingEvidence evidence;
  const Vector3d ahead = Vector3d::UnitX();
  for (int i = 0; i < 100; ++i) {
    evidence.add_turn(ahead, ahead, {0.0, 0.0, 0.05});
    evidence.add_elevation(ahead, Vector3d::UnitZ(), 0.0);
  }
  EXPECT_FALSE(evidence.rotation());
}

/// Robots that fly about a point stay where they are in each other's bodies, too. They lean towards
/// it, and their accelerometers do not show that.
TEST(MountingEvidence, IsNotMisledByAFormationThatTurnsAboutItsCenter) {
  constexpr double kRate = 0.6;  // rad/s
  constexpr double kBank = 0.3;
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0.0, 0.002);
  MountingEvidence evidence;
  const Vector3d u(std::cos(kBank), 0.0, std::sin(kBank));
  const Vector3d vertical(-std::sin(kBank), 0.0, std::cos(kBank));
  for (int i = 0; i < 200; ++i) {
    const Vector3d before = u + Vector3d(0.0, noise(random), noise(random));
    const Vector3d after = u + Vector3d(0.0, noise(random), noise(random));
    evidence.add_turn(before, after, 0.1 * kRate * vertical);
    evidence.add_elevation(u, Vector3d::UnitZ(), std::sin(kBank));
    ASSERT_FALSE(evidence.rotation()) << i;
  }
}

TEST(MountingEvidence, ExcludesARotationThatIsNoMore) {
  const Matrix3d R = about(Vector3d::UnitX(), std::numbers::pi);
  MountingEvidence wrong;
  Swaying(1, R).observe(1, 3.0, wrong);
  EXPECT_FALSE(wrong.excludes(R));
  MountingEvidence right;
  EXPECT_FALSE(right.excludes(R)) << "nothing is known";
  Swaying(1, Matrix3d::Identity()).observe(1, 3.0, right);
  EXPECT_TRUE(right.excludes(R));
}

ImuSample upside_down(const ImuSample& sample) {
  const Matrix3d R = about(Vector3d::UnitX(), std::numbers::pi);
  return {sample.stamp, R * sample.gyro_radps, R * sample.accel_mps2};
}

bool has_fault(const std::vector<TeamFault>& faults, RobotId robot) {
  return std::ranges::any_of(faults, [robot](const TeamFault& fault) {
    return fault.kind == TeamFault::Kind::kMounting && fault.robot == robot && fault.size > 2.5;
  });
}

/// Pairs that turn enough: of forty seeds, 34 are named within five seconds.
class UpsideDown : public testing::TestWithParam<unsigned> {};

TEST_P(UpsideDown, ImuIsNamedAndGivesNoPosesUntilItIsRight) {
  for (const bool is_own : {false, true}) {
    EstimatorPair pair(GetParam());
    Conditions with;
    (is_own ? with.own_imu : with.peer_imu) = upside_down;
    pair.run_for(5s, with);
    const RobotId robot = is_own ? EstimatorPair::kSelf : EstimatorPair::kOther;
    const auto faults = [&] {
      return is_own ? pair.estimator_status().faults : pair.status().faults;
    };
    EXPECT_TRUE(has_fault(faults(), robot));
    EXPECT_EQ(pair.latest(), nullptr);
    EXPECT_EQ(pair.status().reason, is_own ? NoPoseReason::kNoOwnImu : NoPoseReason::kNoPeerImu);

    pair.run_for(8s);  // the jump of the samples is refused at first
    EXPECT_TRUE(faults().empty());
    ASSERT_NE(pair.latest(), nullptr);
    EXPECT_LT(pair.latest()->error.tail<3>().norm(), 0.1);
  }
}

INSTANTIATE_TEST_SUITE_P(ImuMounting, UpsideDown, testing::Values(1U, 7U, 11U, 16U));

TEST(ImuMounting, IsRightInHealthyPairs) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    EstimatorPair pair(seed);
    for (int i = 0; i < 20; ++i) {
      pair.run_for(500ms);
      ASSERT_TRUE(pair.status().faults.empty() && pair.estimator_status().faults.empty()) << seed;
    }
  }
}

}  // namespace
}  // namespace crepes::imu_mounting_test
