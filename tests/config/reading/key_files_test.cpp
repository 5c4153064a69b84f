/// The keys that a configuration names: the swarm's, and the robots' own.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "config/reading/config_file.hpp"
#include "config/schema/mesh_slice.hpp"
#include "tests/config/reading/config_sources_fixture.hpp"

namespace crepes::key_files_test {
namespace {

namespace fs = std::filesystem;
using test::ConfigSources;
using test::kBase;
using test::replaced;

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

}  // namespace
}  // namespace crepes::key_files_test
