#include "config/reading/config_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "drivers/base/scratch_directory.hpp"
#include "tests/support/config_texts.hpp"
#include "tests/support/places.hpp"
#include "tests/support/random_geometry.hpp"

namespace crepes::config_file_test {
namespace {

namespace fs = std::filesystem;

using test::faults_of;
using test::kGood;
using test::replaced;

const fs::path kRoot = source_dir();

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

// A robot whose configuration is older than its program starts all the same.
TEST(ConfigFile, WarnsOfAKeyThatHasNoEffectAnyMore) {
  const CheckedConfig checked =
      check_config_text(replaced("uwb: {noise_m: 0.05}", "estimator: {forget_after_s: 30}"), "f");
  EXPECT_TRUE(checked.faults.empty()) << to_string(checked.faults);
  ASSERT_FALSE(checked.warnings.empty());
  EXPECT_EQ(to_string(checked.warnings.front()),
            "f:11: estimator.forget_after_s: has no effect; a neighbor without inertial samples is "
            "forgotten");
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
  for (const std::string id : {"70000", "65535", "0", "-1"}) {
    EXPECT_EQ(faults_of(replaced("{id: 1}", "{id: " + id + "}")),
              "f:1: robot.id: " + id + " is outside [1, 65534]");
  }
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

TEST(ConfigFile, WritesEveryRotationAsItReadsIt) {
  Config config = check_config_text(kGood, "f").config;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    test::RandomGeometry random(seed);
    config.cameras.at(0).calibration.T_cam_imu.q = random.rotation();
    const std::string written = write_config(config);
    EXPECT_EQ(write_config(check_config_text(written, "f").config), written) << seed;
  }
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
