#include "config/keys/robot_key.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "config/keys/mesh_key.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes::robot_key_test {
namespace {

namespace fs = std::filesystem;

TEST(RobotKeyFile, IsForTheOwnerAloneAndReadAsItWasWritten) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "robot.key";

  const RobotKey written = write_robot_key(file).value();

  EXPECT_TRUE(is_whole(written));
  EXPECT_EQ(read_robot_key(file).value(), written);
  EXPECT_EQ(fs::file_size(file), 64U);
  EXPECT_EQ(fs::status(file).permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_FALSE(write_robot_key(scratch.path() / "other").value() == written);
}

TEST(RobotKeyFile, IsNeverOverwritten) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "robot.key";
  const RobotKey written = write_robot_key(file).value();

  EXPECT_FALSE(write_robot_key(file));

  EXPECT_EQ(read_robot_key(file).value(), written);
}

TEST(RobotKeyFile, IsRefusedForWhatIsWrongWithIt) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "robot.key";
  const auto refusal = [&] {
    const Result<RobotKey> key = read_robot_key(file);
    return key ? "taken" : key.error().message;
  };
  const auto contains = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos && text.find("robot.key: ") != std::string::npos;
  };

  EXPECT_PRED2(contains, refusal(), "No such file");
  ASSERT_TRUE(write_mesh_key(file));
  EXPECT_PRED2(contains, refusal(), "expected a key of 64 bytes");
  EXPECT_PRED2(contains, refusal(), "found 32");
  fs::remove(file);
  ASSERT_TRUE(write_robot_key(file));
  EXPECT_FALSE(read_mesh_key(file)) << "a robot's own key is no swarm's key";
  fs::permissions(file, fs::perms::others_read, fs::perm_options::add);
  EXPECT_PRED2(contains, refusal(), "chmod o=");
  fs::permissions(file, fs::perms::owner_read | fs::perms::owner_write);
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(50).put(0);
  std::fstream(file, std::ios::in | std::ios::out | std::ios::binary).seekp(51).put(0);
  EXPECT_PRED2(contains, refusal(), "is damaged");
}

}  // namespace
}  // namespace crepes::robot_key_test
