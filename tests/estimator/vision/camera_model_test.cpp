#include "estimator/vision/camera_model.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace crepes::camera_model_test {
namespace {

CameraCalibration fisheye(double xi = -0.1723, double alpha = 0.5931) {
  CameraCalibration config;
  config.name = "cam0";
  config.intrinsics = {xi, alpha, 316.9, 316.8, 638.2, 512.5};
  config.resolution = {1280, 1024};
  return config;
}

/// The coefficients of a calibrated 185 degree lens, if none are given.
CameraCalibration kannala_brandt(std::vector<double> k = {-0.0124, 0.0208, -0.0173, 0.0041}) {
  CameraCalibration config = fisheye();
  config.camera_model = CameraModelKind::kPinhole;
  config.intrinsics = {316.9, 316.8, 638.2, 512.5};
  config.distortion_model = DistortionModel::kEquidistant;
  config.distortion_coeffs = std::move(k);
  return config;
}

double uniform(double low, double high) {
  return low + (high - low) * static_cast<double>(*rc::gen::inRange(0, 1000001)) * 1e-6;
}

/// Any camera of either model's domain: also such as nobody builds.
CameraModel any_camera() {
  if (*rc::gen::arbitrary<bool>())
    return *CameraModel::from(fisheye(uniform(-0.95, 0.95), uniform(0.0, 1.0)));
  return *CameraModel::from(kannala_brandt(
      {uniform(-0.3, 0.3), uniform(-0.1, 0.1), uniform(-0.05, 0.05), uniform(-0.01, 0.01)}));
}

Eigen::Vector3d direction(double angle, double azimuth) {
  return {std::sin(angle) * std::cos(azimuth), std::sin(angle) * std::sin(azimuth),
          std::cos(angle)};
}

/// A direction within `max_angle` of the optical axis.
Eigen::Vector3d any_direction(double max_angle) {
  const double angle = uniform(0.0, max_angle);
  return direction(angle, uniform(-std::numbers::pi, std::numbers::pi));
}

/// The greatest angle to the optical axis that projects.
double border_angle(const CameraModel& camera, double azimuth = 0.3) {
  double inside = 0.0;
  double outside = std::numbers::pi;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (inside + outside);
    (camera.project(direction(middle, azimuth)) ? inside : outside) = middle;
  }
  return inside;
}

double round_trip_error(const CameraModel& camera, const Eigen::Vector3d& u, double depth_m) {
  const auto uv = camera.project(depth_m * u);
  if (!uv) return 1.0;
  const auto back = camera.unproject(*uv);
  return back ? (*back - u).norm() : 2.0;
}

TEST(CameraModel, UnprojectsWhatItProjectedForEveryParameterSet) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const Eigen::Vector3d u = any_direction(std::numbers::pi);
    const double depth_m = uniform(0.1, 50.0);
    RC_PRE(camera.project(depth_m * u).has_value());

    RC_ASSERT(round_trip_error(camera, u, depth_m) < 1e-10);
  }));
}

TEST(CameraModel, UnprojectsWhatItProjectedUpToTheBorderOfItsRegion) {
  EXPECT_TRUE(rc::check([] {
    const CameraModel camera = any_camera();
    const double azimuth = uniform(-std::numbers::pi, std::numbers::pi);
    const double border = border_angle(camera, azimuth);
    RC_ASSERT(border > 0.15);

    for (double inwards = 0.1; inwards > 1e-16; inwards *= 0.1) {
      const Eigen::Vector3d u = direction(border - inwards, azimuth);
      // On the border itself, which side of it a direction is on is a matter of rounding.
      if (inwards > 1e-11 || camera.project(u)) RC_ASSERT(round_trip_error(camera, u, 1.0) < 1e-10);
    }
  }));
}

TEST(CameraModel, SeesMoreThanHalfOfTheWorld) {
  const double right_angle = std::numbers::pi / 2.0;
  const CameraModel double_sphere = *CameraModel::from(fisheye());
  const CameraModel kannala = *CameraModel::from(kannala_brandt());

  for (const double degrees : {90.0, 92.5, 100.0, 110.0}) {
    const Eigen::Vector3d u = direction(degrees / 90.0 * right_angle, -2.0);
    EXPECT_LT(round_trip_error(double_sphere, u, 3.0), 1e-13) << degrees;
    EXPECT_LT(round_trip_error(kannala, u, 3.0), 1e-13) << degrees;
  }
}

// At some radii two angles, a right one apart, lead to each other by Newton's steps.
TEST(CameraModel, UnprojectsEveryRadiusOfASteepLens) {
  const CameraModel camera = *CameraModel::from(kannala_brandt({0.0, 0.05, -0.01, -0.001}));
  double worst = 0.0;
  for (double angle = 1.63; angle < 1.65; angle += 1e-6)
    worst = std::max(worst, round_trip_error(camera, direction(angle, 0.3), 1.0));

  EXPECT_LT(worst, 1e-10);
}

TEST(CameraModel, SeesAllTheWorldThroughALensThatNeverFolds) {
  const CameraModel camera = *CameraModel::from(kannala_brandt({0.0, 0.0, 0.0, 0.0}));

  EXPECT_NEAR(border_angle(camera), std::numbers::pi, 1e-9);
  EXPECT_LT(round_trip_error(camera, direction(3.14, 1.0), 2.0), 1e-13);
  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}));
}

/// A pixel within the image circle of `fisheye()`, which does not reach the sensor's corners.
Eigen::Vector2d any_pixel() {
  const double radius = uniform(0.0, 700.0);
  const double azimuth = uniform(-std::numbers::pi, std::numbers::pi);
  return {638.2 + radius * std::cos(azimuth), 512.5 + radius * std::sin(azimuth)};
}

void expect_projects_what_it_unprojected(const CameraCalibration& config) {
  const CameraModel camera = *CameraModel::from(config);
  EXPECT_TRUE(rc::check([&] {
    const Eigen::Vector2d uv = any_pixel();

    const auto u = camera.unproject(uv);

    RC_ASSERT(u.has_value());
    RC_ASSERT(std::abs(u->norm() - 1.0) < 1e-12);
    const auto back = camera.project(3.0 * *u);
    RC_ASSERT(back.has_value());
    RC_ASSERT((*back - uv).norm() < 1e-10 * 1024.0);
  }));
}

TEST(CameraModel, ProjectsWhatItUnprojectedAllOverTheImageCircle) {
  expect_projects_what_it_unprojected(fisheye());
  expect_projects_what_it_unprojected(kannala_brandt());
}

TEST(CameraModel, IsKalibrsEquidistantDistortion) {
  const std::vector<double> k{-0.0124, 0.0208, -0.0173, 0.0041};
  const CameraModel camera = *CameraModel::from(kannala_brandt(k));
  const double t = 1.2;
  double r = t;
  for (std::size_t i = 0; i < 4; ++i) r += k[i] * std::pow(t, 2.0 * static_cast<double>(i) + 3.0);

  const Eigen::Vector2d uv = *camera.project(7.0 * direction(t, 0.6));

  EXPECT_NEAR(uv.x(), 316.9 * r * std::cos(0.6) + 638.2, 1e-11);
  EXPECT_NEAR(uv.y(), 316.8 * r * std::sin(0.6) + 512.5, 1e-11);
}

TEST(CameraModel, EndsWhereTheImageFolds) {
  // r' = 1 - 1.5 t^2
  const CameraModel camera = *CameraModel::from(kannala_brandt({-0.5, 0.0, 0.0, 0.0}));
  const double fold = std::sqrt(1.0 / 1.5);
  const double max_radius = fold - 0.5 * fold * fold * fold;

  EXPECT_NEAR(border_angle(camera), fold, 1e-3);
  EXPECT_FALSE(camera.project(direction(1.1 * fold, 0.0)));
  EXPECT_TRUE(camera.unproject({638.2 + 316.9 * (max_radius - 1e-6), 512.5}));
  EXPECT_FALSE(camera.unproject({638.2 + 316.9 * (max_radius + 1e-6), 512.5}));
}

TEST(CameraModel, FindsAFoldBeyondWhichTheImageGrowsAgain) {
  // r' = (1 - s) (1 - s / 2) with s = t^2: negative from 1 to 2 only.
  const CameraModel camera = *CameraModel::from(kannala_brandt({-0.5, 0.1, 0.0, 0.0}));

  EXPECT_NEAR(border_angle(camera), 1.0, 3e-3);
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

void expect_unprojection_jacobian_matches_differences(const CameraCalibration& config) {
  const CameraModel camera = *CameraModel::from(config);
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

TEST(CameraModel, UnprojectionJacobianMatchesDifferences) {
  expect_unprojection_jacobian_matches_differences(fisheye());
  expect_unprojection_jacobian_matches_differences(kannala_brandt());
}

TEST(CameraModel, JacobiansOnTheOpticalAxisAreThoseBesideIt) {
  for (const CameraCalibration& config : {fisheye(), kannala_brandt()}) {
    const CameraModel camera = *CameraModel::from(config);
    CameraModel::ProjectionJacobian J_p;
    CameraModel::ProjectionJacobian J_p_beside;
    CameraModel::UnprojectionJacobian J_u;
    CameraModel::UnprojectionJacobian J_u_beside;

    ASSERT_TRUE(camera.project({0.0, 0.0, 2.0}, &J_p));
    ASSERT_TRUE(camera.project({1e-7, 1e-7, 2.0}, &J_p_beside));
    ASSERT_TRUE(camera.unproject({638.2, 512.5}, &J_u));
    ASSERT_TRUE(camera.unproject({638.2 + 1e-5, 512.5}, &J_u_beside));

    EXPECT_LT((J_p - J_p_beside).norm(), 1e-4);
    EXPECT_LT((J_u - J_u_beside).norm(), 1e-8);
  }
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

std::string refusal(const CameraCalibration& config) {
  const auto camera = CameraModel::from(config);
  return camera ? std::string() : camera.error().message;
}

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

TEST(CameraModel, RefusesWhatIsNoDoubleSphere) {
  const auto refused = [](std::vector<double> intrinsics) {
    CameraCalibration config = fisheye();
    config.intrinsics = std::move(intrinsics);
    return refusal(config);
  };

  EXPECT_EQ(refused({-0.2, 0.6, 300, 300, 640, 512}), "");
  EXPECT_EQ(refused({0.6, 300, 300, 640, 512}),
            "camera cam0: intrinsics: ds has 6 intrinsics (xi, alpha, fx, fy, cx, cy), not 5");
  EXPECT_EQ(refused({-0.2, 0.6, kNotANumber, 300, 640, 512}),
            "camera cam0: intrinsics: not finite");
  EXPECT_NE(refused({1.2, 0.6, 300, 300, 640, 512}).find("xi"), std::string::npos);
  EXPECT_NE(refused({-0.2, 1.1, 300, 300, 640, 512}).find("alpha"), std::string::npos);
  EXPECT_NE(refused({-0.2, 0.6, -300, 300, 640, 512}).find("10 to 100000 px"), std::string::npos);
  EXPECT_NE(refused({-0.2, 0.6, 300, 300, 640, 5120}).find("resolution"), std::string::npos);
}

TEST(CameraModel, RefusesWhatIsNoKannalaBrandt) {
  const auto refused = [](std::vector<double> k) { return refusal(kannala_brandt(std::move(k))); };
  CameraCalibration of_five = kannala_brandt();
  of_five.intrinsics.push_back(1.0);
  CameraCalibration undistorted = kannala_brandt();
  undistorted.distortion_model = DistortionModel::kNone;

  EXPECT_EQ(refused({0.0, 0.0, 0.0, 0.0}), "");
  EXPECT_EQ(refused({0.0, 0.0, 0.0}),
            "camera cam0: distortion_coeffs: equidistant has 4 (k1, k2, k3, k4), not 3");
  EXPECT_EQ(refused({0.0, kNotANumber, 0.0, 0.0}), "camera cam0: distortion_coeffs: not finite");
  EXPECT_EQ(refused({-50.0, 0.0, 0.0, 0.0}),
            "camera cam0: distortion_coeffs: the image folds less than 10 degrees off the axis");
  EXPECT_EQ(refusal(of_five),
            "camera cam0: intrinsics: pinhole has 4 intrinsics (fu, fv, pu, pv), not 5");
  EXPECT_EQ(refusal(undistorted), "camera cam0: distortion_model: must be equidistant for pinhole");
}

TEST(CameraModel, RefusesDistortionOfADoubleSphere) {
  CameraCalibration config = fisheye();
  config.distortion_model = DistortionModel::kEquidistant;
  config.distortion_coeffs = {0.0, 0.0, 0.0, 0.0};

  EXPECT_EQ(calibration_faults(config).size(), 2U);
  EXPECT_EQ(refusal(config), "camera cam0: distortion_model: ds has no distortion: must be none");
}

}  // namespace
}  // namespace crepes::camera_model_test
