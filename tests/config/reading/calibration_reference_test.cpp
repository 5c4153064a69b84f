/// Calibrations that a configuration names, by Kalibr or Basalt.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "config/reading/config_file.hpp"
#include "tests/config/reading/config_sources_fixture.hpp"
#include "tests/support/places.hpp"

namespace crepes::calibration_reference_test {
namespace {

namespace fs = std::filesystem;
using test::ConfigSources;
using test::kBase;
using test::kMembers;
using test::replaced;

const fs::path kCalibrations = fs::path(source_dir()) / "tests/config/calibration";

class CalibrationReference : public ConfigSources {
 protected:
  CalibrationReference() {
    for (const auto& file : fs::directory_iterator(kCalibrations))
      fs::copy_file(file.path(), path(file.path().filename()));
  }

  [[nodiscard]] std::string camchain_text() const {
    std::ostringstream text;
    text << std::ifstream(path("camchain-imucam.yaml")).rdbuf();
    return text.str();
  }
  void write_camera(const std::string& keys) const {
    write("crepesd.yaml", replaced(kBase, "cameras:", "uwb:", "cameras:\n  - name: cam0\n" + keys));
  }
};

TEST_F(CalibrationReference, ReadsKalibrsFilesWhereTheyLie) {
  write_camera(
      "    calibration: camchain-imucam.yaml\n"
      "    timeshift_cam_imu: 0.001\n"
      "    rate_hz: 100\n"
      "  - {name: rear, calibration: camchain-imucam.yaml, calibration_camera: cam1}\n"
      "imu: {calibration: imu.yaml, gyroscope_random_walk: 0.5}\n");

  const Config config = load();

  ASSERT_EQ(config.cameras.size(), 2U);
  EXPECT_EQ(config.cameras[0].calibration.intrinsics.at(2), 316.7621859215437);
  EXPECT_EQ(config.cameras[0].calibration.T_cam_imu.p.x(), -0.0216401454975);
  EXPECT_EQ(config.cameras[0].calibration.timeshift_cam_imu, 0.001);
  EXPECT_EQ(config.cameras[0].calibration.rate_hz, 100.0);
  EXPECT_EQ(config.cameras[1].calibration.name, "rear");
  EXPECT_EQ(config.cameras[1].calibration.camera_model, CameraModelKind::kPinhole);
  EXPECT_EQ(config.cameras[1].calibration.distortion_coeffs.size(), 4U);
  EXPECT_EQ(config.imu.noise.update_rate, 200.0);
  EXPECT_EQ(config.imu.noise.gyroscope_random_walk, 0.5);
}

TEST_F(CalibrationReference, ReadsBasaltsFileForCameraAndImu) {
  write_camera("    calibration: basalt.json\nimu: {calibration: basalt.json}\n");

  const Config config = load();

  EXPECT_EQ(config.cameras.at(0).calibration.timeshift_cam_imu, -0.002548236);
  EXPECT_EQ(config.imu.noise.accelerometer_noise_density, 0.016);
}

TEST_F(CalibrationReference, ReportsWhatIsWrongWithItOnce) {
  write_camera("    calibration: imu.yaml\n");
  EXPECT_EQ(faults(),
            "crepesd.yaml:8: cameras[0].calibration: has no camera \"cam0\"; see "
            "calibration_camera");
  write_camera("    calibration: camchain-imucam.yaml\n    calibration_camera: cam7\n");
  EXPECT_EQ(faults(),
            "crepesd.yaml:8: cameras[0].calibration: has no camera \"cam7\"; see "
            "calibration_camera");
  write_camera("    calibration: [camchain.yaml]\n");
  EXPECT_EQ(faults(), "crepesd.yaml:8: cameras[0].calibration: expected a name, found a list of 1");
  write_camera("    calibration: camchain.yaml\n");  // knows no IMU
  EXPECT_EQ(faults().substr(0, 38), "camchain.yaml:1: cam0: no T_cam_imu: a");
  write_camera("    calibration: camchain-imucam.yaml\nimu: {calibration: camchain-imucam.yaml}\n");
  EXPECT_EQ(faults(), "crepesd.yaml:9: imu.calibration: says nothing of an inertial sensor");
}

TEST_F(CalibrationReference, OtherCamerasMayBeOfKindsThatAreNotRead) {
  std::string camchain = camchain_text();
  camchain.replace(camchain.find("equidistant"), 11, "radtan");
  write("camchain-imucam.yaml", camchain);

  write_camera("    calibration: camchain-imucam.yaml\n");
  EXPECT_EQ(load().cameras.size(), 1U);

  write_camera("    calibration: camchain-imucam.yaml\n    calibration_camera: cam1\n");
  EXPECT_NE(faults().find("radtan"), std::string::npos) << faults();
}

TEST_F(CalibrationReference, RefusesAnImuWithIntrinsicsOfItsOwn) {
  std::ofstream(path("imu.yaml"), std::ios::app) << "model: scale-misalignment\n";
  write_camera("    calibration: camchain-imucam.yaml\nimu: {calibration: imu.yaml}\n");
  EXPECT_NE(faults().find("model: scale-misalignment"), std::string::npos) << faults();
}

TEST_F(CalibrationReference, RefusesTheNameOfACameraWithoutAFile) {
  write("crepesd.yaml", replaced(kBase, "    T_cam_imu", "uwb:",
                                 "    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], "
                                 "[0, 0, 0, 1]]\n    calibration_camera: cam1\n"));
  EXPECT_EQ(faults(),
            "crepesd.yaml:11: cameras[0].calibration_camera: has no effect without calibration");
}

TEST_F(CalibrationReference, NamesTheCalibrationForAValueThatDoesNotSuit) {
  std::string camchain = camchain_text();
  camchain.replace(camchain.find("[1280, 1024]"), 12, "[5280, 1024]");
  write("camchain-imucam.yaml", camchain);
  write_camera("    calibration: camchain-imucam.yaml\n");

  EXPECT_EQ(faults(), "camchain-imucam.yaml:1: cameras[0].resolution: 5280 is outside [16, 2048]");
}

TEST_F(CalibrationReference, IsWrittenOutByADumpThatLoadsByItself) {
  write("swarm.yaml", kMembers);
  write("crepesd.d/a.yaml", "uwb: {noise_m: 0.2}\n");
  write_camera("    calibration: camchain-imucam.yaml\nimu: {calibration: imu.yaml}\n");
  const std::string dump = write_config(load());

  const CheckedConfig again = check_config_text(dump, "dump");

  ASSERT_TRUE(again.faults.empty()) << to_string(again.faults.front());
  EXPECT_EQ(again.config.uwb.noise.noise_m, 0.2);
  EXPECT_EQ(again.config.imu.noise.update_rate, 200.0);
  EXPECT_EQ(write_config(again.config), dump);
}

}  // namespace
}  // namespace crepes::calibration_reference_test
