/// A configuration out of several files: fragments, and a members file that all robots share. See
/// also key_files_test.cpp and calibration_reference_test.cpp.
#include "config/reading/config_sources.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "drivers/base/unique_fd.hpp"
#include "tests/config/reading/config_sources_fixture.hpp"
#include "tests/support/places.hpp"

namespace crepes::config_sources_test {
namespace {

namespace fs = std::filesystem;
using test::ConfigSources;
using test::kBase;
using test::kMembers;
using test::replaced;

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

TEST_F(ConfigSources, LeavesHiddenFilesAlone) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/.10-noise.yaml", "uwb: {noise_m: nonsense}\n");
  EXPECT_EQ(faults(), "");
}

TEST_F(ConfigSources, WarnsOfAFragmentThatEndsOtherwise) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/20-uwb.yml", "uwb: {noise_m: 0.5}\n");

  const CheckedConfig checked = check();

  EXPECT_EQ(checked.config.uwb.noise.noise_m, 0.05);
  EXPECT_NE(to_string(checked.warnings).find("20-uwb.yml: is ignored: rename it"),
            std::string::npos)
      << to_string(checked.warnings);
}

TEST_F(ConfigSources, MissesNothingWhereAFileCannotBeParsed) {
  write("crepesd.yaml", "robot: {id: 1\n");
  write("crepesd.d/10-noise.yaml", "uwb: {noise_m: 0.1}\n");
  EXPECT_EQ(faults().find('\n'), std::string::npos) << faults();
  EXPECT_NE(faults().find("crepesd.yaml:"), std::string::npos);
}

TEST_F(ConfigSources, FindsAFolderOfPicturesBesideItsFile) {
  write("crepesd.yaml", kBase);
  write("crepesd.d/10-film.yaml", "cameras: [{name: cam0, driver: folder, folder: ../film}]\n");
  EXPECT_EQ(load().cameras.at(0).device.folder, path("film").string());
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

}  // namespace
}  // namespace crepes::config_sources_test
