#include "estimator/vision/camera_model.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <limits>
#include <numbers>

namespace crepes {
namespace {

CameraConfig fisheye(double xi = -0.1723, double alpha = 0.5931) {
  CameraConfig config;
  config.name = "cam0";
  config.intrinsics = {xi, alpha, 316.9, 316.8, 638.2, 512.5};
  config.resolution = {1280, 1024};
  return config;
}

double uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(*rc::gen::inRange(0, 1000001)) * 1e-6;
}

/// Any camera of the model's domain.
CameraModel any_camera() {
  return *CameraModel::from(fisheye(uniform(-0.9, 0.9), uniform(0.0, 1.0)));
}

/// A direction within `max_angle` of the optical axis.
Eigen::Vector3d any_direction(double max_angle) {
  const double angle = uniform(0.0, max_angle);
  const double azimuth = uniform(-std::numbers::pi, std::numbers::pi);
  return {std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth),
          std::cos(angle)};
}

TEST(CameraModel, UnprojectsWhatItProjectedForEveryParameterSet) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const Eigen::Vector3d u = any_direction(std::numbers::pi);
    const double depth_m = uniform(0.1, 50.0);

    const auto uv = camera.project(depth_m * u);
    RC_PRE(uv.has_value());
    // Near the rim a pixel covers ever more of the world and no ten digits are left.
    CameraModel::ProjectionJacobian J;
    RC_ASSERT(camera.project(u, &J).has_value());
    RC_PRE(J.norm() < 1e4 && (J * J.transpose()).determinant() > 1e2 * J.squaredNorm());

    RC_ASSERT((*camera.unproject(*uv) - u).norm() < 1e-10);
  }));
}

/// A pixel within the image circle of `fisheye()`, which does not reach the sensor's corners.
Eigen::Vector2d any_pixel() {
  const double radius = uniform(0.0, 700.0);
  const double azimuth = uniform(-std::numbers::pi, std::numbers::pi);
  return {638.2 + radius * std::cos(azimuth), 512.5 + radius * std::sin(azimuth)};
}

TEST(CameraModel, ProjectsWhatItUnprojectedAllOverTheImageCircle) {
  const CameraModel camera = *CameraModel::from(fisheye());
  EXPECT_TRUE(rc::check([&] {
    const Eigen::Vector2d uv = any_pixel();

    const auto u = camera.unproject(uv);

    RC_ASSERT(u.has_value());
    RC_ASSERT(std::abs(u->norm() - 1.0) < 1e-12);
    const auto back = camera.project(3.0 * *u);
    RC_ASSERT(back.has_value());
    RC_ASSERT((*back - uv).norm() < 1e-9);
  }));
}

TEST(CameraModel, LooksAlongTheOpticalAxisAtThePrincipalPoint) {
  const CameraModel camera = *CameraModel::from(fisheye());

  EXPECT_LT((*camera.unproject({638.2, 512.5}) - Eigen::Vector3d::UnitZ()).norm(), 1e-14);
  EXPECT_GT(camera.unproject({738.2, 512.5})->x(), 0.0);
  EXPECT_GT(camera.unproject({638.2, 612.5})->y(), 0.0);
}

TEST(CameraModel, IsAPinholeWhenBothSpheresVanish) {
  const CameraModel camera = *CameraModel::from(fisheye(0.0, 0.0));

  const Eigen::Vector2d uv = *camera.project({0.3, -0.2, 2.0});

  EXPECT_NEAR(uv.x(), 316.9 * 0.15 + 638.2, 1e-12);
  EXPECT_NEAR(uv.y(), -316.8 * 0.1 + 512.5, 1e-12);
}

TEST(CameraModel, ProjectionJacobianMatchesDifferences) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const Eigen::Vector3d p_C = uniform(0.5, 5.0) * any_direction(1.4);
    CameraModel::ProjectionJacobian J;
    RC_PRE(camera.project(p_C, &J).has_value());
    RC_PRE(J.norm() < 1e4);

    constexpr double kStep = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d d = kStep * Eigen::Vector3d::Unit(i);
      const auto ahead = camera.project(p_C + d);
      const auto behind = camera.project(p_C - d);
      RC_PRE(ahead.has_value() && behind.has_value());
      // Second differences are of order J^2 / f * step^2.
      RC_ASSERT(((*ahead - *behind) / (2.0 * kStep) - J.col(i)).norm() < 1e-5 * (1.0 + J.norm()));
    }
  }));
}

TEST(CameraModel, UnprojectionJacobianMatchesDifferences) {
  const CameraModel camera = *CameraModel::from(fisheye());
  EXPECT_TRUE(rc::check([&] {
    const Eigen::Vector2d uv = any_pixel();
    CameraModel::UnprojectionJacobian J;
    RC_ASSERT(camera.unproject(uv, &J).has_value());

    constexpr double kStep = 1e-3;
    for (int i = 0; i < 2; ++i) {
      const Eigen::Vector2d d = kStep * Eigen::Vector2d::Unit(i);
      const Eigen::Vector3d slope =
          (*camera.unproject(uv + d) - *camera.unproject(uv - d)) / (2.0 * kStep);
      RC_ASSERT((slope - J.col(i)).norm() < 1e-9);
    }
  }));
}

TEST(CameraModel, SeesNothingBehindItAtItsCenterOrOutsideTheImageCircle) {
  const CameraModel camera = *CameraModel::from(fisheye());
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}));
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.0}));
  EXPECT_FALSE(camera.project({kNan, 0.0, 1.0}));
  EXPECT_FALSE(camera.unproject({638.2 + 316.9 * 2.4, 512.5}));  // r > 1 / sqrt(2 alpha - 1)
  EXPECT_FALSE(camera.unproject({kNan, 0.0}));
}

TEST(CameraModel, RefusesParametersOutsideTheModel) {
  const auto refusal = [](std::vector<double> intrinsics) {
    CameraConfig config = fisheye();
    config.intrinsics = std::move(intrinsics);
    const auto camera = CameraModel::from(config);
    return camera ? std::string() : camera.error().message;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

  EXPECT_EQ(refusal({-0.2, 0.6, 300, 300, 640, 512}), "");
  EXPECT_NE(refusal({0.6, 300, 300, 640, 512}).find("got 5 numbers"), std::string::npos);
  EXPECT_NE(refusal({-0.2, 0.6, kNan, 300, 640, 512}).find("not finite"), std::string::npos);
  EXPECT_NE(refusal({1.2, 0.6, 300, 300, 640, 512}).find("xi"), std::string::npos);
  EXPECT_NE(refusal({-0.2, 1.1, 300, 300, 640, 512}).find("alpha"), std::string::npos);
  EXPECT_NE(refusal({-0.2, 0.6, -300, 300, 640, 512}).find("positive"), std::string::npos);
}

}  // namespace
}  // namespace crepes
