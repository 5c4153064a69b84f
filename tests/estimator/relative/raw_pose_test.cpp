#include "estimator/relative/raw_pose.hpp"

#include <gtest/gtest.h>

#include <optional>

#include "estimator/core/constants.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::raw_pose_test {
namespace {

using test::RandomGeometry;

/// Two robots in a world, z up.
struct Pair {
  Pose T_W_B;
  Pose T_W_N;
  Mounting B;
  Mounting N;

  [[nodiscard]] Pose T_B_N() const { return T_W_B.inverse() * T_W_N; }

  /// What their sensors say, without noise.
  [[nodiscard]] MutualSighting sighting() const {
    const auto sees = [](const Pose& T_W_X, const Mounting& x, const Pose& T_W_Y,
                         const Mounting& y) {
      const Eigen::Vector3d line_W = T_W_Y * y.led - T_W_X * x.camera;
      return Sighting{.u = T_W_X.q.conjugate() * line_W.normalized(),
                      .up = T_W_X.q.conjugate() * Eigen::Vector3d::UnitZ(),
                      .mounting = x,
                      .bearing_sigma_rad = 0.003,
                      .tilt_sigma_rad = 0.01};
    };
    return {.B = sees(T_W_B, B, T_W_N, N),
            .N = sees(T_W_N, N, T_W_B, B),
            .range_m = (T_W_B * B.antenna - T_W_N * N.antenna).norm(),
            .range_sigma_m = 0.05};
  }
};

Eigen::Quaterniond attitude(double yaw, double pitch, double roll) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

/// Robots 1 to 20 m apart, tilted by up to 40 degrees, up to 45 degrees above each other.
Pair random_pair(RandomGeometry& random, double mounting_m) {
  const auto tilted = [&] {
    return attitude(random.uniform(-3.1, 3.1), random.uniform(-0.7, 0.7),
                    random.uniform(-0.7, 0.7));
  };
  const auto mounting = [&] {
    const auto arm = [&]() -> Eigen::Vector3d {
      return random.uniform(0.0, mounting_m) * random.direction();
    };
    return Mounting{arm(), arm(), arm()};
  };
  const double azimuth = random.uniform(-3.1, 3.1);
  const double elevation = random.uniform(-0.78, 0.78);
  const Eigen::Vector3d line(std::cos(elevation) * std::cos(azimuth),
                             std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  Pair pair;
  pair.T_W_B = {random.vector(), tilted()};
  pair.T_W_N = {pair.T_W_B.p + random.uniform(1.0, 20.0) * line, tilted()};
  pair.B = mounting();
  pair.N = mounting();
  return pair;
}

std::optional<NoPoseReason> refusal(const MutualSighting& sighting) {
  const auto result = compute_raw_pose(sighting);
  const auto* reason = std::get_if<NoPoseReason>(&result);
  return reason == nullptr ? std::nullopt : std::optional(*reason);
}

Pair level_pair(const Eigen::Vector3d& p_B_N) {
  Pair pair;
  pair.T_W_N = {p_B_N, attitude(1.0, 0.0, 0.0)};
  return pair;
}

TEST(RawPose, RecoversAnyPoseWithLeverArms) {
  RandomGeometry random(1);
  for (int i = 0; i < 500; ++i) {
    const Pair pair = random_pair(random, 0.05);

    const auto result = compute_raw_pose(pair.sighting());

    ASSERT_TRUE(std::holds_alternative<RawPose>(result));
    const auto& raw = std::get<RawPose>(result);
    EXPECT_LT(pose_difference(pair.T_B_N(), raw.T_B_N).norm(), 1e-9);
    EXPECT_LT((pair.T_B_N().inverse().p - raw.p_N_B).norm(), 1e-9);
  }
}

TEST(RawPose, WithoutLeverArmsIsThePapersClosedFormula) {
  RandomGeometry random(2);
  for (int i = 0; i < 500; ++i) {
    const MutualSighting z = random_pair(random, 0.0).sighting();
    // Equations of III-C: level both bearings by roll and pitch, take the difference of headings.
    const auto level = [](const Eigen::Vector3d& up) -> Eigen::Matrix3d {
      const double pitch = std::asin(-up.x());
      const double roll = std::atan2(up.y(), up.z());
      return attitude(0.0, pitch, roll).toRotationMatrix();
    };
    const auto heading = [](const Eigen::Vector3d& v) { return std::atan2(v.y(), v.x()); };
    const Eigen::Matrix3d level_B = level(z.B.up);
    const Eigen::Matrix3d level_N = level(z.N.up);
    const double psi = heading(level_B * z.B.u) - heading(level_N * z.N.u) + std::numbers::pi;
    const Eigen::Matrix3d R_B_N =
        level_B.transpose() * attitude(psi, 0.0, 0.0).toRotationMatrix() * level_N;

    const auto result = compute_raw_pose(z);

    ASSERT_TRUE(std::holds_alternative<RawPose>(result));
    const auto& raw = std::get<RawPose>(result);
    EXPECT_LT((raw.T_B_N.p - z.range_m * z.B.u).norm(), 1e-12);
    EXPECT_LT((raw.p_N_B - z.range_m * z.N.u).norm(), 1e-12);
    EXPECT_LT(test::largest_difference(raw.T_B_N.R(), R_B_N), 1e-12);
  }
}

TEST(RawPose, CovarianceMatchesAMonteCarloWithinTwentyPercent) {
  RandomGeometry random(3);
  for (int run = 0; run < 5; ++run) {
    const Pair pair = random_pair(random, 0.05);
    const MutualSighting clean = pair.sighting();
    const auto reference = std::get<RawPose>(compute_raw_pose(clean));
    const auto noisy = [&] {
      MutualSighting z = clean;
      for (Sighting* s : {&z.B, &z.N}) {
        s->u = (s->u + tangent_basis(s->u) * random.normal_vector<2>(s->bearing_sigma_rad))
                   .normalized();
        s->up = (s->up + tangent_basis(s->up) * random.normal_vector<2>(s->tilt_sigma_rad))
                    .normalized();
      }
      z.range_m += random.normal(z.range_sigma_m);
      return z;
    };

    constexpr int kDraws = 3000;
    Eigen::Matrix<double, 9, 1> sampled = Eigen::Matrix<double, 9, 1>::Zero();
    for (int i = 0; i < kDraws; ++i) {
      const auto result = compute_raw_pose(noisy());
      ASSERT_TRUE(std::holds_alternative<RawPose>(result));
      const auto& raw = std::get<RawPose>(result);
      Eigen::Matrix<double, 9, 1> d;
      d << raw.T_B_N.p - reference.T_B_N.p, raw.p_N_B - reference.p_N_B,
          so3_log(reference.T_B_N.q.conjugate() * raw.T_B_N.q);
      sampled += d.cwiseAbs2() / kDraws;
    }

    for (int i = 0; i < 9; ++i) {
      EXPECT_NEAR(sampled(i) / reference.covariance(i, i), 1.0, 0.2) << "run " << run << " " << i;
    }
  }
}

/// What calibration leaves of one robot: misalignment, accelerometer bias and scale by columns.
using Faults = Eigen::Matrix<double, 15, 1>;

/// As it would be without faults of calibration.
Sighting without(const Faults& faults, Sighting z) {
  const Eigen::Vector3d misalignment = faults.head<3>();
  const Eigen::Vector3d bias = faults.segment<3>(3);
  const auto scale = faults.tail<9>().reshaped(3, 3);
  z.u = so3_exp(-misalignment) * z.u;
  z.up = (z.up - bias / kGravityMps2 - scale * z.up).normalized();
  return z;
}

TEST(RawPose, CalibrationJacobianIsWhatFaultsOfCalibrationDo) {
  RandomGeometry random(12);
  int tried = 0;
  while (tried < 100) {
    const MutualSighting z = random_pair(random, 0.1).sighting();
    const auto found = compute_raw_pose(z);
    const auto* raw = std::get_if<RawPose>(&found);
    if (raw == nullptr) continue;
    ++tried;
    const auto error_of = [&](const MutualSighting& corrected) -> Vector6d {
      const Pose truth = std::get<RawPose>(compute_raw_pose(corrected)).T_B_N;
      Vector6d error;
      error << truth.p - raw->T_B_N.p, so3_log(raw->T_B_N.q.conjugate() * truth.q);
      return error;
    };
    const auto by_B = test::numeric_jacobian<6, 15>([&](const Faults& faults) {
      return error_of({without(faults, z.B), z.N, z.range_m, z.range_sigma_m});
    });
    const auto by_N = test::numeric_jacobian<6, 15>([&](const Faults& faults) {
      return error_of({z.B, without(faults, z.N), z.range_m, z.range_sigma_m});
    });
    const auto by_range =
        test::numeric_jacobian<6, 1>([&](const Eigen::Matrix<double, 1, 1>& bias) {
          return error_of({z.B, z.N, z.range_m - bias(0), z.range_sigma_m});
        });

    const CalibrationJacobian& J = raw->by_calibration;
    Eigen::Matrix<double, 6, 15> J_B;
    J_B << J.by_misalignment_B, J.by_accel_bias_B, J.by_accel_scale_B;
    Eigen::Matrix<double, 6, 15> J_N;
    J_N << J.by_misalignment_N, J.by_accel_bias_N, J.by_accel_scale_N;
    const double tolerance = 1e-5 * by_B.cwiseAbs().maxCoeff();
    EXPECT_LT(test::largest_difference(J_B, by_B), tolerance);
    EXPECT_LT(test::largest_difference(J_N, by_N), tolerance);
    EXPECT_LT(test::largest_difference(J.by_range_bias, by_range), tolerance);
  }
}

TEST(RawPose, RefusesANeighborNearTheVertical) {
  EXPECT_EQ(refusal(level_pair({0.1, 0.0, 3.0}).sighting()), NoPoseReason::kNearVertical);
  EXPECT_EQ(refusal(level_pair({0.0, 0.0, -3.0}).sighting()), NoPoseReason::kNearVertical);
  EXPECT_EQ(refusal(level_pair({1.0, 0.0, 3.0}).sighting()), std::nullopt);
}

TEST(RawPose, RefusesANeighborTooClose) {
  EXPECT_EQ(refusal(level_pair({0.05, 0.0, 0.0}).sighting()), NoPoseReason::kTooClose);
  EXPECT_EQ(refusal(level_pair({0.5, 0.0, 0.0}).sighting()), std::nullopt);
}

TEST(RawPose, RefusesARangeShorterThanTheMountingsAllow) {
  Pair pair = level_pair({3.0, 0.0, 0.0});
  pair.B.antenna = {0.0, 0.5, 0.0};
  pair.N.antenna = {0.0, 0.0, 0.5};
  MutualSighting z = pair.sighting();

  z.range_m = 0.2;

  EXPECT_EQ(refusal(z), NoPoseReason::kNoRange);
}

TEST(RawPose, RefusesTwoLinesOfSightThatContradictEachOther) {
  MutualSighting z = level_pair({3.0, 0.0, 0.5}).sighting();
  const double sigma = std::sqrt(2 * 0.003 * 0.003 + 2 * 0.01 * 0.01);
  const auto raised_by = [&](double angle) {
    MutualSighting raised = z;
    const Eigen::Vector3d across = z.N.u.cross(Eigen::Vector3d::UnitZ()).normalized();
    raised.N.u = so3_exp(angle * across) * z.N.u;
    return raised;
  };

  EXPECT_EQ(refusal(raised_by(4.5 * sigma)), std::nullopt);
  EXPECT_EQ(refusal(raised_by(5.5 * sigma)), NoPoseReason::kUncertain);
}

TEST(RawPose, NotANumberIsRefusedWhereverItStands) {
  const MutualSighting good = level_pair({3.0, 0.0, 0.5}).sighting();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  auto bad_range = good;
  bad_range.range_m = nan;
  auto bad_bearing = good;
  bad_bearing.B.u.y() = nan;
  auto bad_peer_bearing = good;
  bad_peer_bearing.N.u.x() = nan;
  auto bad_tilt = good;
  bad_tilt.N.up.z() = nan;

  EXPECT_TRUE(refusal(bad_range));
  EXPECT_TRUE(refusal(bad_bearing));
  EXPECT_TRUE(refusal(bad_peer_bearing));
  EXPECT_TRUE(refusal(bad_tilt));
}

}  // namespace
}  // namespace crepes::raw_pose_test
