#include "daemon/ctl/setup/import_calibration.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "config/reading/config_file.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "tests/support/places.hpp"

namespace crepes::import_calibration_test {
namespace {

namespace fs = std::filesystem;

const fs::path kFiles = fs::path(source_dir()) / "tests/config/calibration";

constexpr const char* kTheRest = R"(robot: {id: 1}
swarm:
  members:
    - {id: 1, name: r1, pattern: "011111111111111111"}
    - {id: 2, name: r2, duty: 0.3}
)";

/// What our own reader makes of imported files.
Config imported(const std::vector<fs::path>& names) {
  std::vector<fs::path> files;
  for (const fs::path& name : names) files.push_back(kFiles / name);
  const Result<std::string> text = import_calibration(files);
  EXPECT_TRUE(text.has_value()) << text.error().message;
  const CheckedConfig checked = check_config_text(kTheRest + text.value_or(""), "f");
  EXPECT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  return checked.config;
}

/// Why a file is refused in which the first `from` was replaced by `to`; its folder left out.
std::string refusal(const std::string& name, const std::string& from, const std::string& to) {
  std::string text = read_text_file(kFiles / name).value_or("");
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / name;
  std::ofstream(file) << text;

  const Result<std::string> result = import_calibration({file});
  if (result) return "";
  std::string message = result.error().message;
  const std::string folder = file.parent_path().string() + "/";
  for (std::size_t i = message.find(folder); i != std::string::npos; i = message.find(folder))
    message.erase(i, folder.size());
  return message;
}

const std::vector<double> kDoubleSphere{-0.17218762341518474, 0.5930926144379498,
                                        316.7621859215437,    316.6607318112853,
                                        637.6306218547221,    512.6871913341187};
const std::vector<double> kPinhole{318.43219871234, 318.39812374121, 641.12837412398,
                                   509.71298341234};
const std::vector<double> kEquidistant{-0.012453876912342, 0.020812346197312, -0.017361298347129,
                                       0.004112983471234};

void expect_both_cameras(const Config& config) {
  ASSERT_EQ(config.cameras.size(), 2U);
  const CameraCalibration& cam0 = config.cameras[0].calibration;
  EXPECT_EQ(cam0.name, "cam0");
  EXPECT_EQ(cam0.camera_model, CameraModelKind::kDoubleSphere);
  EXPECT_EQ(cam0.intrinsics, kDoubleSphere);
  EXPECT_EQ(cam0.resolution, (std::array<int, 2>{1280, 1024}));
  const CameraCalibration& cam1 = config.cameras[1].calibration;
  EXPECT_EQ(cam1.name, "cam1");
  EXPECT_EQ(cam1.camera_model, CameraModelKind::kPinhole);
  EXPECT_EQ(cam1.distortion_model, DistortionModel::kEquidistant);
  EXPECT_EQ(cam1.intrinsics, kPinhole);
  EXPECT_EQ(cam1.distortion_coeffs, kEquidistant);
}

TEST(ImportCalibration, TakesTheCamerasOfKalibr) {
  const Config config = imported({"camchain-imucam.yaml"});

  expect_both_cameras(config);
  EXPECT_EQ(config.cameras[0].calibration.timeshift_cam_imu, -0.0025482361482113);
  EXPECT_EQ(config.cameras[1].calibration.timeshift_cam_imu, -0.0025391823741232);
  const Pose& T_cam_imu = config.cameras[0].calibration.T_cam_imu;
  EXPECT_EQ(T_cam_imu.p, Eigen::Vector3d(-0.0216401454975, -0.064676986768, 0.00981073058949));
  Eigen::Matrix3d R;
  R << 0.0148655429818, -0.999880929698, 0.00414029679422, 0.999557249008, 0.0149672133247,
      0.025715529948, -0.0257744366974, 0.00375618835797, 0.999660727178;
  EXPECT_LT((T_cam_imu.R() - R).norm(), 1e-11);  // what Kalibr's digits lack to a rotation
}

TEST(ImportCalibration, TakesTheImuOfKalibrAsGivenToItAndAsWrittenByIt) {
  for (const char* file : {"imu.yaml", "imu-output.yaml"}) {
    const ImuNoise imu = imported({"camchain-imucam.yaml", file}).imu.noise;
    EXPECT_EQ(imu.update_rate, 200.0);
    EXPECT_EQ(imu.accelerometer_noise_density, 1.86e-3);
    EXPECT_EQ(imu.accelerometer_random_walk, 4.33e-4);
    EXPECT_EQ(imu.gyroscope_noise_density, 1.87e-4);
    EXPECT_EQ(imu.gyroscope_random_walk, 2.66e-5);
  }
}

TEST(ImportCalibration, TakesBasaltsTransformForTheInverseOfKalibrs) {
  const Config config = imported({"basalt.json"});

  expect_both_cameras(config);
  // p_imu = T_imu_cam p_cam; this camera looks along the body's x axis, right is -y, down is -z.
  const Pose& T_cam_imu = config.cameras[0].calibration.T_cam_imu;
  const Eigen::Vector3d p_imu_cam(-0.01686, -0.06918, 0.00476);
  EXPECT_LT((T_cam_imu * p_imu_cam).norm(), 1e-15);
  EXPECT_LT((T_cam_imu * (p_imu_cam + Eigen::Vector3d::UnitX()) - Eigen::Vector3d::UnitZ()).norm(),
            1e-13);
  EXPECT_LT((T_cam_imu * (p_imu_cam - Eigen::Vector3d::UnitY()) - Eigen::Vector3d::UnitX()).norm(),
            1e-13);
}

TEST(ImportCalibration, TakesBasaltsTimeOffsetAndDensitiesAsKalibrs) {
  const Config config = imported({"basalt.json"});

  EXPECT_EQ(config.cameras[0].calibration.timeshift_cam_imu, -0.002548236);
  EXPECT_EQ(config.cameras[1].calibration.timeshift_cam_imu, -0.002548236);
  EXPECT_EQ(config.imu.noise.update_rate, 200.0);
  EXPECT_EQ(config.imu.noise.accelerometer_noise_density, 0.016);
  EXPECT_EQ(config.imu.noise.gyroscope_noise_density, 0.000282);
  EXPECT_EQ(config.imu.noise.accelerometer_random_walk, 0.001);
  EXPECT_EQ(config.imu.noise.gyroscope_random_walk, 0.0001);
}

TEST(ImportCalibration, ReachesACameraByWayOfTheOneBefore) {
  const std::string text = read_text_file(kFiles / "camchain-imucam.yaml").value_or("");
  const std::size_t begin = text.find("  T_cam_imu:", text.find("cam1:"));
  std::string chained = text;
  chained.erase(begin, text.find("  T_cn_cnm1:") - begin);
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "chained.yaml";
  std::ofstream(file) << chained;
  const Result<std::string> result = import_calibration({file});
  ASSERT_TRUE(result.has_value()) << result.error().message;

  const CheckedConfig checked = check_config_text(kTheRest + *result, "f");

  const Pose direct = imported({"camchain-imucam.yaml"}).cameras[1].calibration.T_cam_imu;
  const Pose by_way = checked.config.cameras.at(1).calibration.T_cam_imu;
  EXPECT_LT((direct.p - by_way.p).norm(), 1e-11);  // what Kalibr's digits lack to a rotation
  EXPECT_LT(direct.q.angularDistance(by_way.q), 1e-7);
}

TEST(ImportCalibration, SaysThatACamchainWithoutImuIsNotEnough) {
  EXPECT_EQ(refusal("camchain.yaml", "cam_overlaps: [1]", "cam_overlaps: []"),
            "camchain.yaml:1: cam0: no T_cam_imu: a camchain of kalibr_calibrate_cameras does not "
            "know the IMU; give that of kalibr_calibrate_imu_camera");
}

TEST(ImportCalibration, RefusesOtherModelsByFileAndLine) {
  const auto of = [](const char* from, const char* to) {
    return refusal("camchain-imucam.yaml", from, to);
  };
  EXPECT_EQ(of("camera_model: ds", "camera_model: omni"),
            "camchain-imucam.yaml:8: cam0.camera_model: expected one of ds, pinhole, found "
            "\"omni\"");
  EXPECT_EQ(of("camera_model: ds", "camera_model: eucm").substr(0, 38),
            "camchain-imucam.yaml:8: cam0.camera_mo");
  EXPECT_EQ(of("model: equidistant", "model: radtan"),
            "camchain-imucam.yaml:30: cam1.distortion_model: expected one of none, equidistant, "
            "found \"radtan\"");
  EXPECT_EQ(of("model: equidistant", "model: none"),
            "camchain-imucam.yaml:30: cam1.distortion_model: must be equidistant for pinhole");
  EXPECT_EQ(refusal("basalt.json", "\"kb4\"", "\"pinhole-radtan8\""),
            "basalt.json:36: value0.intrinsics[1].camera_type: expected one of ds, kb4, found "
            "\"pinhole-radtan8\"");
}

TEST(ImportCalibration, RefusesWhatIsMissingOrOfTheWrongLength) {
  EXPECT_EQ(refusal("camchain-imucam.yaml", "  camera_model: ds\n", ""),
            "camchain-imucam.yaml:1: cam0: camera_model is missing");
  EXPECT_EQ(refusal("camchain-imucam.yaml", "316.7621859215437, ", ""),
            "camchain-imucam.yaml:11: cam0.intrinsics: ds has 6 intrinsics (xi, alpha, fx, fy, cx, "
            "cy), not 5");
  EXPECT_EQ(refusal("imu.yaml", "update_rate:                 200.0", ""),
            "imu.yaml:1: update_rate: is missing: samples a second");
  EXPECT_EQ(refusal("basalt.json", "\"qw\": -0.5", "\"w\": -0.5"),
            "basalt.json:4: value0.T_imu_cam[0].qw: is missing: quaternion");
  EXPECT_EQ(refusal("basalt.json", "\"alpha\": 0.5930926144379498", "\"beta\": 0.59"),
            "basalt.json:26: value0.intrinsics[0].intrinsics.alpha: is missing: Double Sphere");
  EXPECT_EQ(refusal("basalt.json", "            0.016,\n", ""),
            "basalt.json:63: value0.accel_noise_std: expected 3 numbers, found a list of 2");
  EXPECT_EQ(
      refusal("basalt.json",
              "            [\n                1280,\n                1024\n            ],\n", ""),
      "basalt.json:3: value0.T_imu_cam: must be a list of 1, one for each camera, as "
      "resolution is");
}

TEST(ImportCalibration, RefusesTransformsThatAreNotRigid) {
  EXPECT_EQ(refusal("camchain-imucam.yaml", "-0.999880929698", "-0.989880929698"),
            "camchain-imucam.yaml:2: cam0.T_cam_imu: the upper left 3x3 is not a rotation: R^T R "
            "is not I within 0.001");
  EXPECT_EQ(refusal("camchain-imucam.yaml", "  - [0.0, 0.0, 0.0, 1.0]\n", ""),
            "camchain-imucam.yaml:2: cam0.T_cam_imu: expected a 4x4 matrix as 4 rows of 4 numbers, "
            "found a list of 3");
  EXPECT_EQ(refusal("basalt.json", "\"qw\": -0.5", "\"qw\": -0.4"),
            "basalt.json:4: value0.T_imu_cam[0]: the quaternion's length is not 1 within 0.001");
}

TEST(ImportCalibration, RefusesNumbersThatAreNone) {
  EXPECT_EQ(refusal("imu.yaml", "1.86e-03", ".nan"),
            "imu.yaml:2: accelerometer_noise_density: expected a number, found \".nan\"");
  EXPECT_EQ(refusal("camchain-imucam.yaml", "-0.0216401454975", "nan"),
            "camchain-imucam.yaml:2: cam0.T_cam_imu: expected a number, found \"nan\"");
  EXPECT_EQ(refusal("basalt.json", "-2548236", "NaN"),
            "basalt.json:83: value0.cam_time_offset_ns: expected a number, found \"NaN\"");
}

TEST(ImportCalibration, RefusesWhatOurConfigurationWouldNotTake) {
  EXPECT_EQ(refusal("imu.yaml", "200.0", "9000.0"),
            "as imported:2: imu.update_rate: 9000 is outside [25, 1000]");
}

TEST(ImportCalibration, RefusesFilesThatAreSomethingElse) {
  EXPECT_EQ(refusal("imu.yaml", "accelerometer_noise_density: 1.86e-03", "a: [1").substr(0, 9),
            "imu.yaml:");
  EXPECT_NE(refusal("imu.yaml", "accelerometer_noise_density: 1.86e-03", "a: [1").find("not YAML"),
            std::string::npos);
  EXPECT_NE(refusal("basalt.json", "value0", "value1").find("neither a camchain"),
            std::string::npos);
  EXPECT_NE(refusal("basalt.json", "{", "").find("basalt.json:"), std::string::npos);

  const Result<std::string> absent = import_calibration({kFiles / "absent.yaml"});
  ASSERT_FALSE(absent.has_value());
  EXPECT_NE(absent.error().message.find("absent.yaml"), std::string::npos);
}

TEST(ImportCalibration, RefusesTheSameCameraOrImuTwice) {
  const Result<std::string> result =
      import_calibration({kFiles / "camchain-imucam.yaml", kFiles / "basalt.json"});

  ASSERT_FALSE(result.has_value());
  EXPECT_NE(result.error().message.find("cam0: is in another file, too"), std::string::npos);
}

}  // namespace
}  // namespace crepes::import_calibration_test
