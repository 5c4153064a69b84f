/// A configuration out of several files: fragments, a shared members file, calibrations.
#include "config/reading/config_sources.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "config/reading/config_file.hpp"
#include "config/schema/mesh_slice.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/unique_fd.hpp"
#include "tests/support/places.hpp"

namespace crepes::config_sources_test {
namespace {

namespace fs = std::filesystem;

const fs::path kCalibrations = fs::path(source_dir()) / "tests/config/calibration";

constexpr const char* kBase = R"(robot: {id: 1}
swarm:
  members:
    - {id: 1, name: r1, duty: 0.3}
    - {id: 2, name: r2, duty: 0.6}
cameras:
  - name: cam0
    intrinsics: [-0.17, 0.59, 316.7, 316.6, 637.6, 512.6]
    resolution: [1280, 1024]
    T_cam_imu: [[0, -1, 0, 0], [0, 0, -1, 0.01], [1, 0, 0, -0.06], [0, 0, 0, 1]]
uwb: {noise_m: 0.05, port: /dev/uwb}
subscription: {listen: ["127.0.0.1", "::1"]}
)";

constexpr const char* kMembers = R"(swarm:
  slot_ms: 12.5
  members:
    - {id: 1, name: r1, duty: 0.3}
    - {id: 2, name: r2, duty: 0.6}
)";

/// `text` with the lines from the one that begins with `from` up to the one that begins with `to`
/// replaced.
std::string replaced(std::string text, const std::string& from, const std::string& to,
                     const std::string& by) {
  const std::size_t begin = text.find(from);
  const std::size_t end = text.find(to);
  EXPECT_TRUE(begin < end && end != std::string::npos) << from;
  return text.replace(begin, end - begin, by);
}

class ConfigSources : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) const {
    const fs::path file = path(name);
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_.path() / name; }

  [[nodiscard]] CheckedConfig check() const { return check_config(path("crepesd.yaml")); }
  [[nodiscard]] Config load() const {
    const CheckedConfig checked = check();
    EXPECT_EQ(text_of(checked), "");
    return checked.config;
  }
  /// All faults, one a line, files named from the folder.
  [[nodiscard]] std::string faults() const { return text_of(check()); }

 private:
  [[nodiscard]] std::string text_of(const CheckedConfig& checked) const {
    std::string lines;
    const std::string folder = folder_.path().string() + "/";
    for (const ConfigFault& fault : checked.faults) {
      std::string line = to_string(fault);
      for (std::size_t at = line.find(folder); at != std::string::npos; at = line.find(folder))
        line.erase(at, folder.size());
      lines += (lines.empty() ? "" : "\n") + line;
    }
    return lines;
  }

  ScratchDirectory folder_ = ScratchDirectory::create({}).value();
};

TEST_F(ConfigSources, LaysFragmentsOverTheFileInTheOrderOfTheirNames) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/20-noise.yaml", "uwb: {noise_m: 0.2}\n");
  write("crepesd.d/10-noise.yaml", "uwb: {noise_m: 0.1}\nlog: {level: debug}\n");
  write("crepesd.d/30-left-out.yaml.bak", "uwb: {noise_m: 0.3}\n");
  write("crepesd.d/90-later.yaml", "# uwb: {noise_m: 0.4}\n");

  const Config config = load();

  EXPECT_EQ(config.uwb.noise.noise_m, 0.2);
  EXPECT_EQ(config.uwb.device.port, "/dev/uwb");
  EXPECT_EQ(config.log.level, LogLevel::kDebug);
}

TEST_F(ConfigSources, RefusesAFragmentThatIsNoFileAtOnce) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/10-noise.yaml", "uwb: {noise_m: 0.1}\n");
  ASSERT_EQ(::mkfifo(path("crepesd.d/20-pipe.yaml").c_str(), 0600), 0);
  EXPECT_EQ(faults(), "crepesd.d/20-pipe.yaml: is not a file");

  fs::remove(path("crepesd.d/20-pipe.yaml"));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = path("crepesd.d/20-socket.yaml");
  ASSERT_LT(name.size(), sizeof(address.sun_path));
  name.copy(address.sun_path, name.size());
  const UniqueFd socket{::socket(AF_UNIX, SOCK_DGRAM, 0)};
  ASSERT_EQ(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(faults(), "crepesd.d/20-socket.yaml: is not a file");
}

TEST_F(ConfigSources, MergesCamerasByNameAndMembersById) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/cameras.yaml", "cameras: [{name: cam0, exposure_us: 400}]\n");
  write("crepesd.d/members.yaml",
        "swarm: {members: [{id: 2, p_body_led: [1, 2, 3]}, {id: 3, name: r3, duty: 0.8}]}\n");

  const Config config = load();

  ASSERT_EQ(config.cameras.size(), 1U);
  EXPECT_EQ(config.cameras[0].device.light.exposure_us, 400.0);
  EXPECT_EQ(config.cameras[0].calibration.resolution[0], 1280);
  ASSERT_EQ(config.swarm.members.size(), 3U);
  EXPECT_EQ(config.swarm.members[1].p_body_led, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(config.swarm.members[1].duty, 0.6);
}

TEST_F(ConfigSources, ReplacesEveryOtherList) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/a.yaml", "subscription: {listen: [\"127.0.0.2\"]}\n");

  EXPECT_EQ(load().subscription.listen, std::vector<std::string>{"127.0.0.2"});
}

TEST_F(ConfigSources, NamesTheFileAndLineThatAFaultyValueCameFrom) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/a.yaml", "uwb:\n  noise_m: 7\n  niose_m: 1\n");
  write("crepesd.d/b.yaml", "cameras:\n  - name: cam0\n    resolution: [640, 480]\n");
  write("crepesd.d/c.yaml", "log: {level: [}\n");

  EXPECT_EQ(faults(),
            "crepesd.d/a.yaml:2: uwb.noise_m: 7 is outside [0.001, 2]\n"
            "crepesd.d/a.yaml:3: uwb.niose_m: unknown key\n"
            "crepesd.d/c.yaml:1: not YAML: illegal flow end\n"
            "crepesd.yaml:8: cameras[0].intrinsics: the center, the last two, lies "
            "outside the "
            "resolution");
}

TEST_F(ConfigSources, ReadsTheMembersThatAllRobotsShare) {
  write("fleet/swarm.yaml", kMembers);
  write("crepesd.yaml", replaced(kBase, "swarm:", "cameras:",
                                 "swarm: {members_file: fleet/swarm.yaml, period_ms: 40}\n"));

  const Config config = load();

  EXPECT_EQ(config.swarm.members.size(), 2U);
  EXPECT_EQ(config.swarm.slot_ms, 12.5);
  EXPECT_EQ(config.swarm.period_ms, 40.0);
}

TEST_F(ConfigSources, FindsAMembersFileBesideTheFragmentThatNamesIt) {
  write("crepesd.d/swarm.members", kMembers);
  write("crepesd.d/a.yaml", "swarm: {members_file: swarm.members}\n");
  write("crepesd.yaml", replaced(kBase, "swarm:", "cameras:", ""));

  EXPECT_EQ(load().swarm.members.size(), 2U);
}

TEST_F(ConfigSources, TakesALibraryOfPatternsForAMembersFile) {
  const std::string library = source_dir() + "/config/libraries/library64.yaml";
  write("crepesd.yaml",
        replaced(kBase, "swarm:", "cameras:", "swarm: {members_file: " + library + "}\n"));

  EXPECT_EQ(load().swarm.members.size(), 64U);
}

TEST_F(ConfigSources, LaysMembersOverThoseThatAllRobotsShare) {
  write("swarm.yaml", kMembers);
  write("crepesd.yaml",
        replaced(kBase, "swarm:", "cameras:", "swarm: {members_file: swarm.yaml}\n"));
  write("crepesd.d/ranges.yaml", "swarm: {members: [{id: 2, range_delay_m: 0.12}]}\n");

  const Config config = load();

  ASSERT_EQ(config.swarm.members.size(), 2U);
  EXPECT_EQ(config.swarm.members[0].range_delay_m, 0.0);
  EXPECT_EQ(config.swarm.members[1].range_delay_m, 0.12);
  EXPECT_EQ(config.swarm.members[1].duty, 0.6);
}

TEST_F(ConfigSources, RefusesToAddMembersToThoseThatAllRobotsShare) {
  write("swarm.yaml", kMembers);
  write("crepesd.yaml",
        replaced(kBase, "swarm:", "cameras:", "swarm: {members_file: swarm.yaml}\n"));
  write("crepesd.d/a.yaml", "swarm:\n  members:\n    - {id: 3, name: r3, duty: 0.8}\n");

  EXPECT_EQ(faults(), "crepesd.d/a.yaml:3: swarm.members: swarm.yaml has no member 3");
}

TEST_F(ConfigSources, ReportsWhatIsWrongWithAMembersFileOnce) {
  const auto faults_with = [this](const std::string& members) {
    write("swarm.yaml", members);
    write("crepesd.yaml",
          replaced(kBase, "swarm:", "cameras:", "swarm:\n  members_file: swarm.yaml\n"));
    return faults();
  };

  EXPECT_EQ(faults_with("swarm: [\n"), "swarm.yaml:2: not YAML: end of sequence flow not found");
  EXPECT_EQ(faults_with(""), "crepesd.yaml:3: swarm.members_file: swarm.yaml holds no keys");
  EXPECT_EQ(faults_with("uwb: {}\n"),
            "swarm.yaml:1: uwb: a members file holds swarm alone\n"
            "swarm.yaml:1: swarm: is missing from this members file");
  EXPECT_EQ(faults_with("swarm: {members_file: swarm.yaml}\n"),
            "swarm.yaml:1: swarm.members_file: a members file names no other");
  EXPECT_EQ(faults_with(std::string(kMembers) + "    - {id: 2, name: r3, uwb_id: 3, duty: 9}\n"),
            "swarm.yaml:6: swarm.members[2].duty: 9 is outside [0.05, 0.95]\n"
            "swarm.yaml:6: swarm.members[2].id: 2 is taken by swarm.members[1]");
  fs::remove(path("swarm.yaml"));
  EXPECT_EQ(faults(), "crepesd.yaml:3: swarm.members_file: swarm.yaml is not a file");
}

TEST_F(ConfigSources, FindsTheKeyBesideTheFileThatNamesIt) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/20-key.yaml", "net: {key_file: ../mesh.key}\n");
  ASSERT_TRUE(write_mesh_key(path("mesh.key")));

  EXPECT_TRUE(fs::equivalent(load().net.key_file, path("mesh.key")));
}

TEST_F(ConfigSources, ReportsWhatIsWrongWithTheKey) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/20-key.yaml", "net:\n  key_file: mesh.key\n");

  EXPECT_EQ(faults(),
            "crepesd.d/20-key.yaml:2: net.key_file: crepesd.d/mesh.key: No such file or directory");
  write("crepesd.d/mesh.key", "too short");
  fs::permissions(path("crepesd.d/mesh.key"), fs::perms::owner_read);
  EXPECT_EQ(faults(),
            "crepesd.d/20-key.yaml:2: net.key_file: crepesd.d/mesh.key: expected a key of 32 "
            "bytes, as crepesctl keygen makes it, found 9");
}

/// A swarm whose robots have keys of their own; this one's is in robot.key.
class OwnKeys : public ConfigSources {
 protected:
  OwnKeys() {
    own_ = to_text(public_key_of(write_robot_key(path("robot.key")).value()));
    other_ = to_text(public_key_of(write_robot_key(path("other.key")).value()));
    write("crepesd.d/20-key.yaml", "net: {interface: lo, robot_key_file: ../robot.key}\n");
  }

  /// `one` and `two` are added to the members.
  void write_members(const std::string& one, const std::string& two) const {
    write("crepesd.yaml", replaced(kBase, "swarm:", "cameras:",
                                   "swarm:\n  members:\n    - {id: 1, name: r1, duty: 0.3" + one +
                                       "}\n    - {id: 2, name: r2, duty: 0.6" + two + "}\n"));
  }

  /// Keys of the warnings about keys.
  [[nodiscard]] std::string warnings() const {
    std::string keys;
    for (const ConfigFault& warning : check_config(path("crepesd.yaml")).warnings)
      if (warning.key.find("p_body") == std::string::npos) keys += warning.key + "\n";
    return keys;
  }

  static std::string key(const std::string& text) { return ", public_key: \"" + text + "\""; }

  std::string own_;
  std::string other_;
};

TEST_F(OwnKeys, AreReadAndPassedToTheMesh) {
  write_members(key(own_), key(other_));

  const Config config = load();

  EXPECT_TRUE(fs::equivalent(config.net.robot_key_file, path("robot.key")));
  const MeshTrust trust = mesh_trust(config);
  EXPECT_EQ(trust.keys.at(RobotId{1}), parse_public_key(own_));
  EXPECT_EQ(trust.keys.at(RobotId{2}), parse_public_key(other_));
  EXPECT_EQ(warnings(), "");
}

TEST_F(OwnKeys, MustBeTheOnesThatTheMembersKnow) {
  write_members(key(other_), key(own_));
  EXPECT_EQ(faults(), "crepesd.d/20-key.yaml:1: net.robot_key_file: its public key is " + own_ +
                          ", swarm.members has another one for this robot: " + other_);

  write_members(key(own_), key(own_));
  EXPECT_EQ(faults(), "crepesd.yaml:5: swarm.members[1].public_key: " + own_ +
                          " is taken by swarm.members[0]");

  write_members(key(own_), key(own_.substr(1)));
  EXPECT_EQ(faults(),
            "crepesd.yaml:5: swarm.members[1].public_key: expected a public key as crepesctl "
            "keygen prints it, found \"" +
                own_.substr(1) + "\"");

  fs::remove(path("crepesd.d/20-key.yaml"));
  write_members(key(own_), key(other_));
  EXPECT_NE(faults().find("net.robot_key_file: is empty, and swarm.members[0] has a public_key"),
            std::string::npos)
      << faults();
}

TEST_F(OwnKeys, AreRefusedIfEverybodyMayReadThem) {
  write_members(key(own_), key(other_));
  fs::permissions(path("robot.key"), fs::perms::others_read, fs::perm_options::add);

  EXPECT_NE(faults().find("net.robot_key_file: "), std::string::npos) << faults();
  EXPECT_NE(faults().find("is open to everybody"), std::string::npos) << faults();
}

TEST_F(OwnKeys, AreMissedWhereOthersHaveThem) {
  write_members(key(own_), "");
  EXPECT_EQ(warnings(), "swarm.members[1].public_key\n");

  write_members("", "");
  EXPECT_EQ(warnings(), "swarm.members[0].public_key\n");

  fs::remove(path("crepesd.d/20-key.yaml"));
  ASSERT_TRUE(write_mesh_key(path("mesh.key")));
  write("crepesd.d/10-net.yaml", "net: {interface: lo, key_file: ../mesh.key}\n");
  EXPECT_EQ(warnings(), "");  // nobody else is on lo
  write("crepesd.d/10-net.yaml", "net: {interface: eth9, key_file: ../mesh.key}\n");
  EXPECT_EQ(warnings(), "net.robot_key_file\nnet.interface\n");
}

TEST_F(OwnKeys, OfAnExcludedRobotAreNotBelieved) {
  write_members(key(own_), key(other_) + ", excluded: true");

  const MeshTrust trust = mesh_trust(load());

  EXPECT_EQ(trust.excluded, std::set<RobotId>{RobotId{2}});
  EXPECT_FALSE(trust.keys.contains(RobotId{2}));
  EXPECT_EQ(warnings(), "");

  write_members(key(own_) + ", excluded: true", key(other_));
  EXPECT_EQ(warnings(), "swarm.members[0].excluded\n");
}

class CalibrationReference : public ConfigSources {
 protected:
  CalibrationReference() {
    for (const auto& file : fs::directory_iterator(kCalibrations))
      fs::copy_file(file.path(), path(file.path().filename()));
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

TEST_F(CalibrationReference, NamesTheCalibrationForAValueThatDoesNotSuit) {
  std::ostringstream text;
  text << std::ifstream(path("camchain-imucam.yaml")).rdbuf();
  std::string camchain = text.str();
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
}  // namespace crepes::config_sources_test
