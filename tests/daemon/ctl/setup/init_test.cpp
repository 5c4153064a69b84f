#include "daemon/ctl/setup/init.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/stages/worker.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/sleep.hpp"
#include "drivers/base/text_file.hpp"
#include "drivers/imu/witmotion.hpp"
#include "drivers/sim/pseudo_terminal.hpp"
#include "estimator/core/constants.hpp"
#include "estimator/vision/camera_model.hpp"
#include "tests/support/fake_iio.hpp"

namespace crepes::init_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class Init : public testing::Test {
 protected:
  Init() {
    options_.dir = folder_.path() / "crepes";
    options_.search_devices = false;
    options_.interface = "lo";
  }

  Result<InitReport> run() {
    std::ostringstream out;
    Questions questions(nullptr, out);
    return init(options_, questions);
  }
  /// With somebody who answers.
  Result<InitReport> run(const std::string& answers) {
    std::istringstream in(answers);
    Questions questions(&in, asked_);
    return init(options_, questions);
  }
  [[nodiscard]] Config load() const { return load_config(options_.dir / "crepesd.yaml").value(); }
  [[nodiscard]] std::string text_of(const std::string& name) const {
    return read_text_file(options_.dir / name).value_or("");
  }

  ScratchDirectory folder_ = ScratchDirectory::create({}).value();
  InitOptions options_;
  std::ostringstream asked_;
};

TEST_F(Init, WritesAConfigurationThatTheDaemonAccepts) {
  options_.id = 2;
  options_.robots = 3;
  options_.p_body_led = {0.05, 0.0, 0.01};
  options_.p_body_uwb = {-0.04, 0.02, 0.1};
  options_.camera_driver = "v4l2";
  options_.camera_device = "/dev/video0";
  options_.resolution = {1280, 800};
  options_.rate_hz = 120.0;

  const auto report = run();

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_TRUE(report->faults.empty()) << to_string(report->faults.front());
  const Config config = load();
  EXPECT_EQ(config.robot.id, RobotId{2});
  ASSERT_EQ(config.swarm.members.size(), 3U);
  EXPECT_EQ(config.swarm.members[2].name, "r3");
  EXPECT_EQ(config.swarm.members[2].p_body_uwb, Eigen::Vector3d(-0.04, 0.02, 0.1));
  EXPECT_EQ(config.cameras[0].device.driver, CameraDriver::kV4l2);
  EXPECT_EQ(config.cameras[0].calibration.resolution, (std::array{1280, 800}));
  EXPECT_EQ(config.cameras[0].calibration.rate_hz, 120.0);
  EXPECT_FALSE(config.cameras[0].calibration.calibrated);
}

TEST_F(Init, NamesTheFileThatItMayNotWriteAndWhy) {
  constexpr uid_t kNobody = 65534;
  options_.id = 1;
  options_.robots = 2;
  options_.p_body_led = {0.0, 0.0, 0.0};
  fs::create_directories(options_.dir);
  for (const fs::path& dir : {folder_.path(), options_.dir}) fs::permissions(dir, fs::perms{0555});

  const uid_t self = ::geteuid();
  ASSERT_EQ(::seteuid(self == 0 ? kNobody : self), 0);  // root may write everywhere
  const auto report = run();
  ASSERT_EQ(::seteuid(self), 0);
  fs::permissions(folder_.path(), fs::perms::owner_all);  // to be removed
  fs::permissions(options_.dir, fs::perms::owner_all);

  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().message,
            (options_.dir / "crepesd.yaml").string() + ": Permission denied");
  EXPECT_TRUE(fs::is_empty(options_.dir));
}

TEST_F(Init, WritesSlotsThatASlowCameraCanRead) {
  options_.id = 1;
  options_.robots = 2;
  options_.rate_hz = 30.0;

  const auto report = run();

  ASSERT_TRUE(report) << report.error().message;
  ASSERT_TRUE(report->faults.empty()) << to_string(report->faults);
  EXPECT_EQ(load().swarm.slot_ms, 67.0);
  EXPECT_EQ(to_string(report->warnings).find("frames a slot"), std::string::npos);

  options_.rate_hz = 200.0;
  options_.force = true;
  ASSERT_TRUE(run());
  EXPECT_EQ(text_of("swarm.yaml").find("slot_ms"), std::string::npos);
}

TEST_F(Init, GuessesALensOfTheFieldOfViewThatLooksWhereConfigured) {
  options_.id = 1;
  options_.robots = 2;
  options_.look = "left";
  options_.fov_deg = 180.0;
  options_.p_body_led = {0.0, 0.1, 0.0};

  ASSERT_TRUE(run());

  const CameraCalibration camera = load().cameras[0].calibration;
  const CameraModel model = CameraModel::from(camera).value();
  const Pose T_B_C = camera.T_cam_imu.inverse();
  const Eigen::Vector3d ahead = T_B_C.q * model.unproject({639.5, 511.5}).value();
  EXPECT_LT((ahead - Eigen::Vector3d::UnitY()).norm(), 1e-6);
  EXPECT_LT((T_B_C.p - Eigen::Vector3d(0.0, 0.1, 0.0)).norm(), 1e-9);
  // The image circle touches the upper border: there it sees straight up, 90 degrees off.
  const Eigen::Vector3d top = T_B_C.q * model.unproject({639.5, 0.5}).value();
  EXPECT_LT((top - Eigen::Vector3d::UnitZ()).norm(), 0.01);
}

TEST_F(Init, RefusesToReplaceFilesAndNamesThemAll) {
  options_.id = 1;
  options_.robots = 2;
  ASSERT_TRUE(run());
  const std::string before = text_of("crepesd.yaml");
  fs::remove(options_.dir / "camchain-imucam.yaml");
  options_.id = 2;

  const auto again = run();

  ASSERT_FALSE(again);
  for (const char* name : {"crepesd.yaml", "10-devices.yaml", "swarm.yaml", "--force"})
    EXPECT_NE(again.error().message.find(name), std::string::npos) << again.error().message;
  EXPECT_EQ(text_of("crepesd.yaml"), before);
  EXPECT_FALSE(fs::exists(options_.dir / "camchain-imucam.yaml"));
}

TEST_F(Init, KeepsWhatItReplacesUnderAnotherName) {
  options_.id = 1;
  options_.robots = 2;
  ASSERT_TRUE(run());
  const std::string before = text_of("crepesd.yaml");
  options_.id = 2;
  options_.force = true;

  ASSERT_TRUE(run());

  EXPECT_EQ(load().robot.id, RobotId{2});
  EXPECT_EQ(text_of("crepesd.yaml~"), before);
}

TEST_F(Init, KeepsTheMembersThatAnotherRobotBroughtAlong) {
  options_.id = 1;
  options_.robots = 3;
  ASSERT_TRUE(run());
  const std::string members = text_of("swarm.yaml");
  for (const char* name : {"crepesd.yaml", "crepesd.d/10-devices.yaml", "camchain-imucam.yaml"})
    fs::remove(options_.dir / name);
  options_.robots.reset();
  options_.id = 4;
  const auto stranger = run();
  options_.id = 3;

  ASSERT_TRUE(run());

  ASSERT_FALSE(stranger);
  EXPECT_NE(stranger.error().message.find("has the members 1, 2, 3"), std::string::npos)
      << stranger.error().message;
  EXPECT_EQ(text_of("swarm.yaml"), members);
  EXPECT_EQ(load().robot.id, RobotId{3});
}

TEST_F(Init, RefusesALeverArmThatTheMembersOfAnotherRobotDoNotHave) {
  options_.id = 1;
  options_.robots = 2;
  options_.p_body_led = {0.05, 0.0, 0.01};
  ASSERT_TRUE(run());
  for (const char* name : {"crepesd.yaml", "crepesd.d/10-devices.yaml", "camchain-imucam.yaml"})
    fs::remove(options_.dir / name);
  options_.robots.reset();
  options_.id = 2;
  options_.p_body_uwb = {0.0, 0.0, 0.1};
  const auto another = run();
  options_.p_body_uwb.reset();

  const auto same = run();

  ASSERT_FALSE(another);
  EXPECT_EQ(another.error().code, ErrorCode::kUsage);
  EXPECT_EQ(another.error().message, "--uwb: " + (options_.dir / "swarm.yaml").string() +
                                         " is there and stays as it is: write p_body_uwb of robot "
                                         "2 into it");
  EXPECT_TRUE(same) << same.error().message;
}

TEST_F(Init, AsksForWhatIsNotGivenUntilTheAnswerIsGood) {
  options_.interface.reset();

  const auto report =
      run("two\n2\n"           // id
          "\n"                 // robots: as proposed
          "0.05 0 0.01\n"      // LED ring
          "0 0\n0 0 0.1\n"     // antenna
          "1280x800\n120\n\n"  // picture
          "sideways\nup\n"     // look
          "\n/dev/ttyUSB3\n"   // IMU: not connected yet; UWB
          "lo\n");

  ASSERT_TRUE(report) << report.error().message << asked_.str();
  const Config config = load();
  EXPECT_EQ(config.robot.id, RobotId{2});
  EXPECT_EQ(config.swarm.members.size(), 2U);
  EXPECT_EQ(config.swarm.members[0].p_body_uwb, Eigen::Vector3d(0, 0, 0.1));
  EXPECT_EQ(config.cameras[0].calibration.resolution, (std::array{1280, 800}));
  EXPECT_EQ(config.imu.device.port, "");
  EXPECT_EQ(config.uwb.device.port, "/dev/ttyUSB3");
  EXPECT_NE(asked_.str().find("expected a whole number"), std::string::npos) << asked_.str();
  EXPECT_NE(asked_.str().find("expected 3 numbers"), std::string::npos) << asked_.str();
}

TEST_F(Init, SaysWhichQuestionHadNoAnswer) {
  const auto ended = run("1\n3\n");
  const auto nobody = run();

  ASSERT_FALSE(ended);
  EXPECT_NE(ended.error().message.find("no answer to: center of the LED ring"), std::string::npos)
      << ended.error().message;
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().code, ErrorCode::kUsage);
  EXPECT_NE(nobody.error().message.find("--id"), std::string::npos) << nobody.error().message;
  EXPECT_FALSE(fs::exists(options_.dir));
}

TEST_F(Init, TakesTheDevicesThatItHears) {
  PseudoTerminal line = PseudoTerminal::open().value();
  options_.search_devices = true;
  options_.devices.dev = folder_.path() / "dev";
  options_.devices.iio.devices = folder_.path() / "sys";
  options_.camera_driver = "none";
  const fs::path port = options_.devices.dev / "serial/by-id/usb-imu";
  fs::create_directories(port.parent_path());
  fs::create_symlink(line.path(), port);
  const Worker sensor("imu", [&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      line.write(encode_witmotion({0.1, 0.2, 0.3}, {0.0, 0.0, 9.81}));
      sleep_for(10ms);
    }
  });
  options_.id = 1;
  options_.robots = 2;

  ASSERT_TRUE(run());

  const Config config = load();
  EXPECT_EQ(config.imu.device.port, port.string());
  EXPECT_EQ(config.imu.device.protocol, ImuProtocol::kWitMotion);
  EXPECT_EQ(config.uwb.device.port, "");
}

TEST_F(Init, TakesTheImuOfTheKernel) {
  FakeIio machine;
  add_icm42688(machine);
  options_.search_devices = true;
  options_.devices.dev = folder_.path() / "dev";
  options_.devices.iio = machine.paths();
  options_.camera_driver = "none";
  options_.id = 1;
  options_.robots = 2;

  ASSERT_TRUE(run());

  EXPECT_EQ(load().imu.device.port, "icm42688");
  EXPECT_EQ(load().imu.device.protocol, ImuProtocol::kIio);
}

TEST_F(Init, PrintsASheetWithTheAxesAndRoomForEveryRobot) {
  options_.id = 1;
  options_.robots = 2;
  options_.p_body_uwb = {-0.04, 0.02, 0.1};

  const auto report = run();

  ASSERT_TRUE(report);
  for (const char* part : {"x, forward", "y, left", "z, up", "robot 2 (r2)", "______", " 0.020"})
    EXPECT_NE(report->text.find(part), std::string::npos) << part << "\n" << report->text;
  EXPECT_FALSE(report->warnings.empty());  // lever arms that nobody measured
}

TEST_F(Init, NamesTheDevicesThatAreStillToBeFound) {
  options_.id = 1;
  options_.robots = 2;
  options_.uwb_port = "/dev/ttyUSB7";

  const auto report = run();

  ASSERT_TRUE(report);
  const std::string to_do = to_string(report->warnings);
  for (const char* key : {"10-devices.yaml: cameras[0].driver: ", "10-devices.yaml: imu.port: "})
    EXPECT_NE(to_do.find(key), std::string::npos) << to_do;
  EXPECT_EQ(to_do.find("uwb.port"), std::string::npos) << to_do;
}

TEST_F(Init, LeadsToASealedAndSignedMesh) {
  options_.id = 1;
  options_.robots = 2;

  const auto report = run();

  // In this order: a file of members that is copied before has no keys.
  ASSERT_TRUE(report);
  std::size_t at = report->text.find("Next:");
  for (const char* part : {"keygen", "key_file: mesh.key", "robot_key_file: robot.key",
                           "public_key", "copy that file to all robots", "systemctl start"}) {
    at = report->text.find(part, at);
    ASSERT_NE(at, std::string::npos) << part << "\n" << report->text;
  }
}

TEST_F(Init, ReportsInJsonWhatItWrote) {
  options_.id = 1;
  options_.robots = 2;
  options_.json = true;

  const auto reported = nlohmann::json::parse(run().value().text);

  EXPECT_TRUE(reported["ok"]);
  EXPECT_EQ(reported["written"].size(), 4U);
  EXPECT_TRUE(fs::exists(reported["written"][0].get<std::string>()));
  EXPECT_FALSE(reported["warnings"].empty());
}

TEST(RobotPlan, TurnsTheCameraByRotationsAlone) {
  for (const Choice<Look>& choice : kLooks) {
    const Eigen::Matrix3d R_C_B = R_camera_body(choice.value);

    EXPECT_NEAR(R_C_B.determinant(), 1.0, 1e-12) << choice.name;
    EXPECT_TRUE((R_C_B * R_C_B.transpose()).isIdentity(1e-12)) << choice.name;
  }
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  EXPECT_EQ(R_camera_body(Look::kForward) * x, Eigen::Vector3d::UnitZ());
  EXPECT_EQ(R_camera_body(Look::kDown) * x, -Eigen::Vector3d::UnitY());  // forward is up in it
}

}  // namespace
}  // namespace crepes::init_test
