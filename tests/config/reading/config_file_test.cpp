#include "config/reading/config_file.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/base/scratch_directory.hpp"
#include "tests/support/places.hpp"

namespace crepes::config_file_test {
namespace {

namespace fs = std::filesystem;

const fs::path kRoot = source_dir();

/// A small good file; each test breaks one thing in it.
constexpr const char* kGood = R"(robot: {id: 1}
swarm:
  members:
    - {id: 1, name: r1, pattern: "011111111111111111"}
    - {id: 2, name: r2, duty: 0.3}
cameras:
  - name: cam0
    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]
    resolution: [1280, 1024]
    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]
uwb: {noise_m: 0.05}
)";

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = kGood;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// All faults of a text, one a line, as the daemon prints them.
std::string faults_of(const std::string& text) {
  std::string lines;
  for (const ConfigFault& fault : check_config_text(text, "f").faults)
    lines += (lines.empty() ? "" : "\n") + to_string(fault);
  return lines;
}

TEST(ConfigFile, ReadsAGoodFile) {
  const CheckedConfig checked = check_config_text(kGood, "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  EXPECT_EQ(checked.config.robot.id, RobotId{1});
  EXPECT_EQ(checked.config.swarm.members.at(0).pattern, "011111111111111111");
  EXPECT_EQ(checked.config.swarm.members.at(1).duty, 0.3);
  EXPECT_EQ(checked.config.cameras.at(0).calibration.resolution.at(1), 1024);
  EXPECT_EQ(checked.config.uwb.noise.noise_m, 0.05);
  const Eigen::Vector3d p_C =
      checked.config.cameras.at(0).calibration.T_cam_imu * Eigen::Vector3d(1, 2, 3);
  EXPECT_TRUE(p_C.isApprox(Eigen::Vector3d(-2, -2.99, 0.94))) << p_C.transpose();
}

TEST(ConfigFile, SuggestsTheRightKeyForAMisspeltOne) {
  EXPECT_EQ(faults_of(replaced("noise_m", "niose_m")),
            "f:11: uwb.niose_m: unknown key; did you mean noise_m?");
}

TEST(ConfigFile, ReportsAMisspeltRequiredKeyOnce) {
  EXPECT_EQ(faults_of(replaced("intrinsics", "intrinsic")),
            "f:8: cameras[0].intrinsic: unknown key; did you mean intrinsics?");
}

TEST(ConfigFile, ReportsAnUnknownKeyThatIsLikeNoOther) {
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}", "telemetry: 5")),
            "f:11: telemetry: unknown key");
}

TEST(ConfigFile, SaysWhatWasExpectedAndWhatWasFound) {
  EXPECT_EQ(faults_of(replaced("0.05", "loud")),
            R"(f:11: uwb.noise_m: expected a number, found "loud")");
  EXPECT_EQ(faults_of(replaced("{id: 1}", "{id: 1.5}")),
            R"(f:1: robot.id: expected a whole number, found "1.5")");
  EXPECT_EQ(faults_of(replaced("[1280, 1024]", "[1280]")),
            "f:9: cameras[0].resolution: expected 2 whole numbers, found a list of 1");
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}", "graph: {enabled: maybe}")),
            R"(f:11: graph.enabled: expected true or false, found "maybe")");
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}", "uwb:")),
            "f:11: uwb: expected a mapping of keys to values, found nothing");
}

TEST(ConfigFile, RefusesNumbersThatAreNotFinite) {
  EXPECT_EQ(faults_of(replaced("0.05", ".nan")),
            R"(f:11: uwb.noise_m: expected a number, found ".nan")");
  EXPECT_EQ(faults_of(replaced("0.05", "nan")),
            R"(f:11: uwb.noise_m: expected a number, found "nan")");
  EXPECT_EQ(faults_of(replaced("316.7", "1e999")),
            R"(f:8: cameras[0].intrinsics: expected a number, found "1e999")");
}

TEST(ConfigFile, SaysTheBoundsOfAValueOutsideThem) {
  EXPECT_EQ(faults_of(replaced("0.05", "7")), "f:11: uwb.noise_m: 7 is outside [0.001, 2]");
  EXPECT_EQ(faults_of(replaced("{id: 1}", "{id: 70000}")),
            "f:1: robot.id: 70000 is outside [0, 65535]");
}

TEST(ConfigFile, ListsTheChoicesOfAnUnknownOne) {
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}", "estimator: {profile: best}")),
            R"(f:11: estimator.profile: expected one of tight, paper, found "best")");
}

TEST(ConfigFile, RefusesAKeyGivenTwice) {
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}", "uwb: {noise_m: 0.05, noise_m: 0.06}")),
            "f:11: uwb.noise_m: is given again in line 11");
  EXPECT_EQ(faults_of(std::string(kGood) + "robot: {id: 2}\n"),
            "f:1: robot: is given again in line 12");
}

TEST(ConfigFile, SaysThatACameraIsWithoutCalibration) {
  const std::string text =
      replaced("    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]\n", "");

  EXPECT_EQ(faults_of(text),
            "f:7: cameras[0].intrinsics: is missing: ds: [xi, alpha, fx, fy, cx, cy]; "
            "pinhole: "
            "[fu, fv, pu, pv]");
}

TEST(ConfigFile, RefusesIntrinsicsThatAreNoDoubleSphere) {
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

TEST(ConfigFile, ReadsACameraOfKannalaAndBrandtAsKalibrWritesIt) {
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

TEST(ConfigFile, RefusesDistortionThatDoesNotFitTheCameraModel) {
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

TEST(ConfigFile, RefusesATransformThatIsNotRigid) {
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

TEST(ConfigFile, RoundsARotationThatIsNearlyOneToOne) {
  const CheckedConfig checked =
      check_config_text(replaced("[0, -1, 0, 0]", "[0.0002, -1.0003, 0, 0]"), "f");

  ASSERT_TRUE(checked.faults.empty());
  const Eigen::Matrix3d R = checked.config.cameras.at(0).calibration.T_cam_imu.R();
  EXPECT_TRUE((R * R.transpose()).isIdentity(1e-14));
}

TEST(ConfigFile, ReadsHowReadingsOfTheImuBecomeTheBodys) {
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

TEST(ConfigFile, RefusesMountingsAndCorrectionsThatCannotBe) {
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

TEST(ConfigFile, RefusesPatternsThatCannotBlinkAnId) {
  const std::string good = "011111111111111111";
  EXPECT_EQ(faults_of(replaced(good, "01112111")),
            R"(f:4: swarm.members[0].pattern: a pattern is made of 0 and 1 only, not "01112111")");
  EXPECT_EQ(faults_of(replaced(good, "0111")),
            "f:4: swarm.members[0].pattern: a pattern has 8 to 32 slots, not 4");
  EXPECT_EQ(faults_of(replaced(good, "11111111")),
            "f:4: swarm.members[0].pattern: a pattern has both lit and dark slots");
}

TEST(ConfigFile, RefusesCodesThatNoCameraCanTellApart) {
  EXPECT_EQ(faults_of(replaced("duty: 0.3", "pattern: \"111111111111110111\"")),
            "f:5: swarm.members[1].pattern: the same pattern, shifted, as that of "
            "swarm.members[0]: no camera can tell the two apart");
  EXPECT_EQ(faults_of(replaced("pattern: \"011111111111111111\"", "duty: 0.3")),
            "f:5: swarm.members[1].duty: within 0.02 of the duty of swarm.members[0]: no camera "
            "can tell the two apart");
}

TEST(ConfigFile, KnowsARepeatedPatternForTheSameLight) {
  std::string text = replaced("011111111111111111", "0111101111");
  text.replace(text.find("duty: 0.3"), 9, "pattern: \"110111101111011\"");

  EXPECT_NE(faults_of(text).find("the same pattern, shifted"), std::string::npos);
}

TEST(ConfigFile, WantsExactlyOneCodeAMember) {
  const std::string expected = "f:5: swarm.members[1]: give exactly one of pattern and duty";
  EXPECT_EQ(faults_of(replaced(", duty: 0.3", "")), expected);
  EXPECT_EQ(faults_of(replaced("duty: 0.3", "duty: 0.3, pattern: \"0011111111\"")), expected);
}

TEST(ConfigFile, WantsDistinctMembersAndThisRobotAmongThem) {
  EXPECT_EQ(faults_of(replaced("{id: 2, name: r2", "{id: 1, name: r2, uwb_id: 9")),
            "f:5: swarm.members[1].id: 1 is taken by swarm.members[0]");
  EXPECT_EQ(faults_of(replaced("name: r2", "name: r1")),
            "f:5: swarm.members[1].name: r1 is taken by swarm.members[0]");
  EXPECT_EQ(faults_of(replaced("name: r2", "name: r2, uwb_id: 1")),
            "f:5: swarm.members[1].uwb_id: 1 is taken by swarm.members[0]");
  std::string both_zero = replaced("name: r2", "name: r2, uwb_id: 0");
  both_zero.replace(both_zero.find("name: r1"), 8, "name: r1, uwb_id: 0");
  EXPECT_EQ(faults_of(both_zero), "f:5: swarm.members[1].uwb_id: 0 is taken by swarm.members[0]");
  EXPECT_EQ(faults_of(replaced("{id: 1}", "{id: 3}")),
            "f:1: robot.id: 3 is not among swarm.members");
}

TEST(ConfigFile, RefusesNamesThatLeadOutOfADirectory) {
  EXPECT_EQ(faults_of(replaced("name: r2", "name: ../r2")),
            "f:5: swarm.members[1].name: a name is 1 to 32 letters, digits, - or _, not \"../r2\"");
}

TEST(ConfigFile, WantsMembersAndCameras) {
  const std::string text = "robot: {id: 1}\nswarm: {members: []}\ncameras: []\n";

  EXPECT_EQ(faults_of(text),
            "f:2: swarm.members: is empty: list every robot, this one too\n"
            "f:3: cameras: is empty: without a camera nobody is recognized");
}

TEST(ConfigFile, RefusesASecondCameraOfTheSameName) {
  std::string text = kGood;
  const std::size_t from = text.find("  - name: cam0");
  const std::size_t to = text.find("uwb:");
  text.insert(to, text.substr(from, to - from));

  EXPECT_EQ(faults_of(text), "f:11: cameras[1].name: cam0 is taken by cameras[0]");
}

TEST(ConfigFile, PushesPosesToOneHostEach) {
  const auto with = [](const std::string& push) {
    return replaced("uwb: {noise_m: 0.05}", "subscription: {push: [" + push + "]}");
  };

  EXPECT_EQ(faults_of(with("{address: 10.0.0.9, port: 9870, rate_hz: 20, format: json}, {}")), "");
  EXPECT_EQ(faults_of(with("{address: laptop}")),
            "f:11: subscription.push[0].address: \"laptop\" is not one host's numeric IPv4 or IPv6 "
            "address");
  for (const char* nobody : {"255.255.255.255", "239.1.2.3", "0.0.0.0", "\"ff02::1\""})
    EXPECT_NE(faults_of(with(std::string("{address: ") + nobody + "}")).find("is not one host's"),
              std::string::npos);
  EXPECT_EQ(faults_of(with("{}, {port: 47475}")),
            "f:11: subscription.push[1].port: is the daemon's own");
  EXPECT_NE(faults_of(with("{format: xml}")).find("expected one of json, plotjuggler"),
            std::string::npos);
  EXPECT_EQ(faults_of(with("{}, {}, {}, {}, {}, {}, {}, {}, {}")),
            "f:11: subscription.push: more than 8");
}

TEST(ConfigFile, ServesPosesAtNumericAddresses) {
  EXPECT_EQ(faults_of(replaced("uwb: {noise_m: 0.05}",
                               "subscription: {listen: [\"::1\", 0.0.0.0, localhost]}")),
            "f:11: subscription.listen: \"localhost\" is not a numeric IPv4 or IPv6 address");
}

TEST(ConfigFile, RefusesAddressesThatCannotServe) {
  const auto listening = [](const std::string& addresses) {
    return faults_of(
        replaced("uwb: {noise_m: 0.05}", "subscription: {listen: [" + addresses + "]}"));
  };
  EXPECT_EQ(listening("224.0.0.1"),
            "f:11: subscription.listen: \"224.0.0.1\" is no host's address");
  EXPECT_EQ(listening("127.0.0.1, 127.0.0.1"),
            "f:11: subscription.listen: \"127.0.0.1\" is listed twice");
}

TEST(ConfigFile, RefusesNumbersThatCannotBeMeant) {
  const auto with = [](const std::string& from, const std::string& to) {
    const std::string faults = faults_of(replaced(from, to));
    EXPECT_FALSE(faults.empty()) << to;
    return faults.substr(0, faults.find(':', faults.find(':', 2) + 2));
  };
  EXPECT_EQ(with("0.01], [1", "1.0e+4], [1"), "f:10: cameras[0].T_cam_imu");
  EXPECT_EQ(with("0.01], [1", "1.0e+300], [1"), "f:10: cameras[0].T_cam_imu");
  EXPECT_EQ(with("316.7", "1.0e-300"), "f:8: cameras[0].intrinsics");
  EXPECT_EQ(with("uwb:", "imu: {accelerometer: {bias: [1.0e+300, 0, 0]}}\nuwb:"),
            "f:11: imu.accelerometer.bias");
  EXPECT_EQ(with("uwb: {", "imu: {port: /dev/ttyUSB0}\nuwb: {port: /dev/ttyUSB0, "),
            "f:12: uwb.port");
  EXPECT_EQ(with("duty: 0.3", "duty: 0.3, p_body_uwb: [0, 0, 60]"),
            "f:5: swarm.members[1].p_body_uwb");
  EXPECT_EQ(with("uwb:", "net: {interface: " + std::string(5000, 'x') + "}\nuwb:"),
            "f:11: net.interface");
  EXPECT_EQ(with("uwb:", "recording: {socket: /" + std::string(200, 'x') + "}\nuwb:"),
            "f:11: recording.socket");
  EXPECT_EQ(with("uwb:", "recording: {socket: \"/a\\0b\"}\nuwb:"), "f:11: recording.socket");
}

TEST(ConfigFile, WarnsOfWhatCanHardlyBeMeant) {
  const auto warnings_of = [](const std::string& text) {
    const CheckedConfig checked = check_config_text(text, "f");
    EXPECT_TRUE(checked.faults.empty());
    std::string keys;
    for (const ConfigFault& warning : checked.warnings)
      keys += fmt::format("{} {}\n", warning.line, warning.key);
    return keys;
  };
  const std::string sound =
      replaced("duty: 0.3", "duty: 0.3, p_body_led: [0.1, 0, 0], p_body_uwb: [0, 0, 0.1]");
  const auto and_in = [&](const std::string& from, const std::string& to) {
    std::string text = sound;
    text.replace(text.find("\"}"), 2, "\", p_body_led: [0.1, 0, 0], p_body_uwb: [0, 0, 0.1]}");
    return text.replace(text.find(from), from.size(), to) + "net: {interface: lo}\n";
  };

  EXPECT_EQ(warnings_of(and_in("id: 1", "id: 1")), "");
  EXPECT_EQ(warnings_of(sound + "net: {interface: lo}\n"),
            "4 swarm.members[0].p_body_led\n4 swarm.members[0].p_body_uwb\n");
  EXPECT_EQ(warnings_of(and_in("[0.1, 0, 0]", "[3, 0, 0]")), "4 swarm.members[0].p_body_led\n");
  EXPECT_EQ(warnings_of(and_in("[[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]",
                               "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]")),
            "10 cameras[0].T_cam_imu\n");
  EXPECT_EQ(warnings_of(and_in("resolution:", "rate_hz: 120\n    resolution:")),
            "9 cameras[0].rate_hz\n");
  EXPECT_EQ(
      warnings_of(and_in("resolution:", "driver: folder\n    folder: /nowhere\n    resolution:")),
      "10 cameras[0].folder\n");
  EXPECT_EQ(warnings_of(and_in("{noise_m: 0.05}", "{noise_m: 0.05}") + "#"), "");
  std::string elsewhere = and_in("id: 1", "id: 1");
  elsewhere.replace(elsewhere.find("interface: lo"), 13, "interface: nowhere9");
  EXPECT_EQ(warnings_of(elsewhere), "12 net.key_file\n12 net.interface\n");
}

TEST(ConfigFile, PrintsEachFaultInOneLineWhateverTheFileContains) {
  const std::string faults = faults_of(replaced("name: r1", "name: \"a\\nb\\e[2J\""));

  EXPECT_EQ(faults.find('\n'), std::string::npos);
  EXPECT_EQ(faults.find('\x1b'), std::string::npos);
  EXPECT_NE(faults.find("a\\x0ab\\x1b[2J"), std::string::npos) << faults;
}

TEST(ConfigFile, RefusesAPipeAtOnce) {
  const auto scratch = ScratchDirectory::create("").value();
  const fs::path pipe = scratch.path() / "crepesd.yaml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);

  EXPECT_EQ(load_config(pipe).error().message, pipe.string() + ": is not a file");
  EXPECT_EQ(load_config("/dev/zero").error().message, "/dev/zero: is not a file");
}

TEST(ConfigFile, ReportsAllFaultsAtOnceInOrderOfLines) {
  std::string text = replaced("{id: 1}", "{idd: 1}");
  text.replace(text.find("duty: 0.3"), 9, "duty: 3.0");
  text.replace(text.find("0.05"), 4, "[]");

  EXPECT_EQ(faults_of(text),
            "f:1: robot.idd: unknown key; did you mean id?\n"
            "f:5: swarm.members[1].duty: 3 is outside [0.05, 0.95]\n"
            "f:11: uwb.noise_m: expected a number, found a list of 0");
}

TEST(ConfigFile, NamesEveryRequiredKeyOfAnEmptyMapping) {
  EXPECT_EQ(
      faults_of("{}"),
      "f:1: robot.id: is missing: this robot's id; must be one of swarm.members\n"
      "f:1: swarm.members: is missing: all robots of the swarm, this one included\n"
      "f:1: cameras: is missing: this robot's cameras; exposure, exposure_us and gain are live");
}

TEST(ConfigFile, RefusesTextThatIsNoConfiguration) {
  EXPECT_EQ(faults_of(""), "f:1: is empty");
  EXPECT_EQ(faults_of("a: [1, 2"), "f:1: not YAML: end of sequence flow not found");
  EXPECT_EQ(faults_of("hello"), "f:1: expected a mapping of keys to values, found \"hello\"");
  EXPECT_EQ(faults_of(std::string(kGood) + "---\nuwb: {noise_m: 1}\n"),
            "f:1: holds more than one YAML document");
  // Of this text yaml-cpp finds one document after the other without an end.
  EXPECT_EQ(faults_of("cameras:m. x\n  # c\n  ,\n    n# E\n# W\n"),
            "f:1: holds more than one YAML document");
  EXPECT_FALSE(faults_of(std::string("\0\1\2\xff", 4)).empty());
}

TEST(ConfigFile, SurvivesEveryTruncationOfAGoodFile) {
  const std::string text = kGood;
  const std::size_t needed = text.find("uwb:");

  for (std::size_t length = 0; length < needed - 1; ++length)
    EXPECT_FALSE(faults_of(text.substr(0, length)).empty()) << length;
}

TEST(ConfigFile, RefusesTextNestedWithoutEnd) {
  EXPECT_FALSE(faults_of("uwb: " + std::string(100000, '[')).empty());
}

TEST(ConfigFile, SaysThatAFileIsNotThere) {
  const Result<Config> config = load_config("/nowhere/crepesd.yaml");

  ASSERT_FALSE(config.has_value());
  EXPECT_EQ(config.error().message,
            "/nowhere/crepesd.yaml: cannot be opened: No such file or directory");
  EXPECT_EQ(load_config("/").error().message, "/: is a directory");
}

TEST(ConfigFile, RefusesWhatACamerasDriverCannotDo) {
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

TEST(ConfigFile, RefusesAliasesThatGrowWithoutEnd) {
  std::string bomb = "a: &a0 [x]\n";
  for (int i = 1; i < 30; ++i) {
    const std::string below = "*a" + std::to_string(i - 1);
    bomb += "b" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + below + ", " + below +
            ", " + below + "]\n";
  }
  EXPECT_NE(faults_of(bomb).find("too large or nested too deep"), std::string::npos);
  EXPECT_NE(faults_of("uwb: &a {b: *a}\n").find("too large or nested too deep"), std::string::npos);
}

TEST(ConfigFile, ReadsAnAliasAsWhatItStandsFor) {
  std::string text = replaced("pattern: \"011111111111111111\"",
                              "pattern: \"011111111111111111\", p_body_led: &led [1, 2, 3]");
  text.replace(text.find("duty: 0.3"), 9, "duty: 0.3, p_body_led: *led");

  const CheckedConfig checked = check_config_text(text, "f");

  ASSERT_TRUE(checked.faults.empty()) << to_string(checked.faults.front());
  EXPECT_EQ(checked.config.swarm.members.at(1).p_body_led, Eigen::Vector3d(1, 2, 3));
}

TEST(ConfigFile, WritesWhatItReadsBackUnchanged) {
  const Config config = check_config_text(kGood, "f").config;
  const std::string written = write_config(config);

  EXPECT_EQ(faults_of(written), "");
  EXPECT_EQ(write_config(check_config_text(written, "f").config), written);
}

TEST(ConfigFile, WritesTextThatNeedsQuotes) {
  Config config = check_config_text(kGood, "f").config;
  config.imu.device.port = "/dev/a \"b\" \\ #: \t'\n\x01";

  const CheckedConfig read = check_config_text(write_config(config), "f");

  ASSERT_TRUE(read.faults.empty()) << to_string(read.faults.front());
  EXPECT_EQ(read.config.imu.device.port, config.imu.device.port);
}

TEST(ConfigFile, ReferenceOnDiskIsUpToDate) {
  std::ifstream file(kRoot / "config/crepesd.yaml");
  std::ostringstream text;
  text << file.rdbuf();

  EXPECT_EQ(text.str(), reference_config())
      << "renew it: crepesd --write-reference > config/crepesd.yaml";
}

std::vector<fs::path> yaml_files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

TEST(ConfigFile, FaultsKnowTheirSection) {
  const auto in = [](const std::string& key) { return ConfigFault{"f", 1, key, "is wrong"}; };

  EXPECT_TRUE(is_in(in("swarm"), &Config::swarm));
  EXPECT_TRUE(is_in(in("swarm.members[0].id"), &Config::swarm));
  EXPECT_TRUE(is_in(in("cameras[1].driver"), &Config::cameras));
  EXPECT_FALSE(is_in(in("swarming.members"), &Config::swarm)) << "a key that is misspelled";
  EXPECT_FALSE(is_in(in("imu.device"), &Config::uwb));
  EXPECT_FALSE(is_in(in(""), &Config::robot)) << "the whole file";
}

TEST(ConfigFile, EveryFileInConfigLoads) {
  const std::vector<fs::path> files = yaml_files_below(kRoot / "config");

  EXPECT_GE(files.size(), 3U);
  for (const fs::path& file : files) {
    const bool is_part =
        file.parent_path().filename() == "libraries" ||
        file.filename() == "swarm.yaml" ||  // see ctl_codebook_test
        file.filename() == "camchain-imucam.yaml" ||
        file.parent_path().parent_path().filename() == "cameras";  // see documented_steps.py
    if (is_part) continue;
    const Result<Config> config = load_config(file);
    EXPECT_TRUE(config.has_value()) << config.error().message;
  }
}

TEST(ConfigFile, ReadsTheConfigurationsOfTheRecordedSwarms) {
  const fs::path datasets = kRoot / "../shared/datasets";
  if (!fs::exists(datasets)) GTEST_SKIP() << "no recordings on this machine";

  for (const fs::path& file : yaml_files_below(datasets)) {
    if (file.filename() != "crepesd.yaml") continue;
    const Result<Config> config = load_config(file);
    EXPECT_TRUE(config.has_value()) << config.error().message;
  }
}

}  // namespace
}  // namespace crepes::config_file_test
