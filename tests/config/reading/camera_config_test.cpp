#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "config/reading/config_file.hpp"
#include "tests/support/config_texts.hpp"

namespace crepes::camera_config_test {
namespace {

using test::faults_of;
using test::kGood;
using test::replaced;

TEST(CameraConfig, SaysThatACameraIsWithoutCalibration) {
  const std::string text =
      replaced("    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]\n", "");

  EXPECT_EQ(faults_of(text),
            "f:7: cameras[0].intrinsics: is missing: ds: [xi, alpha, fx, fy, cx, cy]; "
            "pinhole: "
            "[fu, fv, pu, pv]");
}

TEST(CameraConfig, RefusesIntrinsicsThatAreNoDoubleSphere) {
  EXPECT_EQ(faults_of(replaced(", 512.6]", "]")),
            "f:8: cameras[0].intrinsics: ds has 6 intrinsics (xi, alpha, fx, fy, cx, "
            "cy), not 5");
  EXPECT_EQ(faults_of(replaced("0.59", "1.59")),
            "f:8: cameras[0].intrinsics: alpha, the second, is outside [0, 1]");
  EXPECT_EQ(faults_of(replaced("637.6", "1637.6")),
            "f:8: cameras[0].intrinsics: the center, the last two, lies outside the "
            "resolution");
}

constexpr const char* kDoubleSphere = "    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]";

TEST(CameraConfig, ReadsACameraOfKannalaAndBrandtAsKalibrWritesIt) {
  const CheckedConfig checked =
      check_config_text(replaced(kDoubleSphere,
                                 "    camera_model: pinhole\n"
                                 "    intrinsics: [316.7, 316.6, 637.6, 512.6]\n"
                                 "    distortion_model: equidistant\n"
                                 "    distortion_coeffs: [-0.01, 0.02, -0.017, 0.004]"),
                        "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  const CameraConfig& camera = checked.config.cameras.at(0);
  EXPECT_EQ(camera.calibration.camera_model, CameraModelKind::kPinhole);
  EXPECT_EQ(camera.calibration.distortion_coeffs,
            (std::vector<double>{-0.01, 0.02, -0.017, 0.004}));
}

TEST(CameraConfig, RefusesDistortionThatDoesNotFitTheCameraModel) {
  EXPECT_EQ(faults_of(replaced(kDoubleSphere, std::string(kDoubleSphere) +
                                                  "\n    distortion_model: equidistant\n"
                                                  "    distortion_coeffs: [0, 0, 0, 0]")),
            "f:9: cameras[0].distortion_model: ds has no distortion: must be none\n"
            "f:10: cameras[0].distortion_coeffs: ds has no distortion: must be empty");
  EXPECT_EQ(faults_of(replaced(kDoubleSphere,
                               "    camera_model: pinhole\n    intrinsics: [316.7, 316.6, 637.6]\n"
                               "    distortion_model: equidistant\n"
                               "    distortion_coeffs: [0, 0, 0]")),
            "f:9: cameras[0].intrinsics: pinhole has 4 intrinsics (fu, fv, pu, pv), not 3\n"
            "f:11: cameras[0].distortion_coeffs: equidistant has 4 (k1, k2, k3, k4), not 3");
}

TEST(CameraConfig, RefusesATransformThatIsNotRigid) {
  EXPECT_EQ(faults_of(replaced("[0, -1, 0, 0]", "[0, -1.01, 0, 0]")),
            "f:10: cameras[0].T_cam_imu: the upper left 3x3 is not a rotation: R^T R "
            "is not I "
            "within 0.001");
  EXPECT_EQ(faults_of(replaced("[0, -1, 0, 0]", "[0, 1, 0, 0]")),
            "f:10: cameras[0].T_cam_imu: the upper left 3x3 mirrors: its determinant is -1");
  EXPECT_EQ(faults_of(replaced("[0, 0, 0, 1]", "[0, 0, 0, 2]")),
            "f:10: cameras[0].T_cam_imu: the last row must be 0 0 0 1");
  EXPECT_EQ(faults_of(replaced(", [0, 0, 0, 1]", "")),
            "f:10: cameras[0].T_cam_imu: expected a 4x4 matrix as 4 rows of 4 numbers, "
            "found a "
            "list of 3");
}

TEST(CameraConfig, RoundsARotationThatIsNearlyOneToOne) {
  const CheckedConfig checked =
      check_config_text(replaced("[0, -1, 0, 0]", "[0.0002, -1.0003, 0, 0]"), "f");

  ASSERT_TRUE(checked.faults.empty());
  const Eigen::Matrix3d R = checked.config.cameras.at(0).calibration.T_cam_imu.R();
  EXPECT_TRUE((R * R.transpose()).isIdentity(1e-14));
}

TEST(CameraConfig, ReadsHowReadingsOfTheImuBecomeTheBodys) {
  const CheckedConfig checked = check_config_text(
      replaced("uwb:",
               "imu:\n  protocol: xsens\n"
               "  T_body_imu: [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n"
               "  accelerometer: {bias: [1, 2, 3], scale: [1, 1, 1.5],\n"
               "    misalignment: [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}\n"
               "uwb:"),
      "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  const ImuDeviceConfig& imu = checked.config.imu.device;
  EXPECT_EQ(imu.protocol, ImuProtocol::kXsens);
  EXPECT_TRUE((imu.T_body_imu.q * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_EQ(imu.accelerometer.bias.z(), 3.0);
  EXPECT_EQ(imu.accelerometer.misalignment(0, 1), 0.1);
  EXPECT_EQ(imu.gyroscope.scale, Eigen::Vector3d(1, 1, 1));
}

TEST(CameraConfig, RefusesMountingsAndCorrectionsThatCannotBe) {
  const auto with_imu = [](const std::string& keys) {
    return faults_of(replaced("uwb:", "imu: {" + keys + "}\nuwb:"));
  };
  EXPECT_EQ(with_imu("T_body_imu: [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]"),
            "f:11: imu.T_body_imu: the body's origin is the IMU: the last column must be 0");
  EXPECT_EQ(with_imu("gyroscope: {misalignment: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}"),
            "f:11: imu.gyroscope.misalignment: mirrors or flattens: its determinant is below 0.1");
  EXPECT_EQ(with_imu("gyroscope: {misalignment: [[1, 0, 0], [0, 1, 0], [0, 0, 3]]}"),
            "f:11: imu.gyroscope.misalignment: 3 is outside [-2, 2]");
  EXPECT_EQ(with_imu("accelerometer: {misalignment: [1, 2, 3]}"),
            "f:11: imu.accelerometer.misalignment: expected a 3x3 matrix as 3 rows of 3 numbers, "
            "found \"1\"");
}

TEST(CameraConfig, RefusesASecondCameraOfTheSameName) {
  std::string text = kGood;
  const std::size_t from = text.find("  - name: cam0");
  const std::size_t to = text.find("uwb:");
  text.insert(to, text.substr(from, to - from));

  EXPECT_EQ(faults_of(text), "f:11: cameras[1].name: cam0 is taken by cameras[0]");
}

TEST(CameraConfig, RefusesWhatACamerasDriverCannotDo) {
  const auto with = [](const std::string& keys) {
    return faults_of(replaced("resolution: [1280, 1024]", "resolution: [1280, 1024]\n    " + keys));
  };

  EXPECT_EQ(with("exposure_us: 5000"),
            "f:10: cameras[0].exposure_us: is longer than a frame at rate_hz");
  EXPECT_EQ(with("exposure_us: 4999"), "");
  EXPECT_EQ(with("exposure: auto"),
            "f:10: cameras[0].exposure: auto needs exposure_us, the longest exposure");
  EXPECT_EQ(with("rolling_shutter_us_per_row: -4.9"),
            "f:10: cameras[0].rolling_shutter_us_per_row: all rows together take longer than a "
            "frame at rate_hz");
  EXPECT_EQ(with("rolling_shutter_us_per_row: 4.4"), "");
  EXPECT_EQ(with("driver: v4l2"), "f:7: cameras[0].device: driver v4l2 needs one, as /dev/video0");
  EXPECT_NE(with("driver: libcamera\n    trigger: hardware").find(".trigger:"), std::string::npos);
  EXPECT_NE(with("driver: libcamera\n    offset: [8, 0]").find(".offset:"), std::string::npos);
  EXPECT_NE(with("driver: v4l2\n    device: d\n    trigger: hardware").find(".trigger:"),
            std::string::npos);
  EXPECT_NE(with("driver: mindvision\n    gain: 2").find(".gain:"), std::string::npos);
  EXPECT_NE(with("driver: mindvision\n    offset: [8, 0]").find(".offset:"), std::string::npos);
  EXPECT_EQ(with("driver: aravis\n    trigger: hardware\n    gain: 2\n    offset: [8, 0]"), "");
}

}  // namespace
}  // namespace crepes::camera_config_test
