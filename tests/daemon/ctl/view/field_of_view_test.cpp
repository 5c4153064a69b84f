#include "daemon/ctl/view/field_of_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace crepes::field_of_view_test {
namespace {

using Json = nlohmann::json;

/// Looks ahead, 0.1 m in front of the IMU. A Double Sphere lens with xi = alpha = 0 is a pinhole.
CameraCalibration camera_of(std::vector<double> intrinsics) {
  CameraCalibration camera;
  camera.name = "cam0";
  camera.intrinsics = std::move(intrinsics);
  camera.resolution = {201, 101};
  Eigen::Matrix3d R_B_C;
  R_B_C << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.T_cam_imu = Pose{{0.1, 0.0, 0.0}, Eigen::Quaterniond(R_B_C)}.inverse();
  return camera;
}

Eigen::Vector3d direction(const Json& row) {
  return {row[0].get<double>(), row[1].get<double>(), row[2].get<double>()};
}

TEST(FieldOfView, HasTheBorderOfThePictureInTheBody) {
  const Json json = Json::parse(field_of_view_json(camera_of({0, 0, 100, 100, 100, 50})));

  EXPECT_EQ(json["name"], "cam0");
  EXPECT_NEAR(json["p"][0].get<double>(), 0.1, 1e-9);
  ASSERT_EQ(json["border"].size(), 40U);
  // The upper left corner: as far to the left as ahead, and half as far up.
  EXPECT_NEAR((direction(json["border"][0]) - Eigen::Vector3d(1, 1, 0.5).normalized()).norm(), 0.0,
              1e-4);
  // The lower right corner is opposite in order.
  EXPECT_NEAR((direction(json["border"][20]) - Eigen::Vector3d(1, -1, -0.5).normalized()).norm(),
              0.0, 1e-4);
}

TEST(FieldOfView, EndsAtTheImageCircleOfTheLens) {
  // The image circle has a radius of 1 / sqrt(2 alpha - 1) focal lengths: 56 px, the corner is at
  // 112 px.
  const Json json = Json::parse(field_of_view_json(camera_of({0, 0.9, 50, 50, 100, 50})));

  for (const Json& row : json["border"]) {
    const Eigen::Vector3d u_B = direction(row);
    EXPECT_NEAR(u_B.norm(), 1.0, 1e-4);
    EXPECT_LT(u_B.x(), 0.8) << "every border is far from the middle";
  }
  // On the circle r^2 = 1.25 the lens sees m_z / sqrt(m_z^2 + r^2) with m_z = (1 - 0.81 r^2) / 0.1.
  EXPECT_NEAR(direction(json["border"][0]).x(), -0.125 / 1.125, 0.01);
}

TEST(FieldOfView, IsNullForAFaultyCalibration) {
  EXPECT_EQ(field_of_view_json(camera_of({})), "null");
}

}  // namespace
}  // namespace crepes::field_of_view_test
