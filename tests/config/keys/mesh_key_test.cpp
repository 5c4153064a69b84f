#include "config/keys/mesh_key.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes::mesh_key_test {
namespace {

namespace fs = std::filesystem;

TEST(MeshKey, WritesThirtyTwoRandomBytesForTheOwnerAlone) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  ASSERT_TRUE(write_mesh_key(scratch.path() / "a"));
  ASSERT_TRUE(write_mesh_key(scratch.path() / "b"));

  const std::string a = read_text_file(scratch.path() / "a").value();
  EXPECT_EQ(a.size(), 32U);
  EXPECT_NE(a, read_text_file(scratch.path() / "b").value());
  EXPECT_EQ(fs::status(scratch.path() / "a").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
}

TEST(MeshKey, NeverOverwrites) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  ASSERT_TRUE(write_mesh_key(scratch.path() / "key"));
  const std::string before = read_text_file(scratch.path() / "key").value();
  fs::create_symlink(scratch.path() / "elsewhere", scratch.path() / "link");

  const auto again = write_mesh_key(scratch.path() / "key");
  const auto through_link = write_mesh_key(scratch.path() / "link");

  ASSERT_FALSE(again);
  EXPECT_NE(again.error().message.find("not overwritten"), std::string::npos);
  EXPECT_EQ(read_text_file(scratch.path() / "key").value(), before);
  EXPECT_FALSE(through_link);
  EXPECT_FALSE(fs::exists(scratch.path() / "elsewhere"));
}

TEST(MeshKey, LeavesNothingBehindWhereThereIsNoRoom) {
  const auto full = write_mesh_key("/nowhere/key");

  ASSERT_FALSE(full);
  EXPECT_NE(full.error().message.find("/nowhere/key"), std::string::npos);
}

TEST(MeshKey, IsReadAsItWasWritten) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "key";
  const MeshKey written = write_mesh_key(file).value();
  const MeshKey other = write_mesh_key(scratch.path() / "other").value();

  EXPECT_EQ(read_mesh_key(file).value(), written);
  EXPECT_EQ(fingerprint(written).size(), 8U);
  EXPECT_NE(fingerprint(written), fingerprint(other));
}

TEST(MeshKey, IsRefusedForWhatIsWrongWithItsFile) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const fs::path file = scratch.path() / "key";
  const auto refusal = [&] {
    const Result<MeshKey> key = read_mesh_key(file);
    return key ? "taken" : key.error().message;
  };
  const auto contains = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos && text.find("key: ") != std::string::npos;
  };

  EXPECT_PRED2(contains, refusal(), "No such file");
  fs::create_directory(file);
  EXPECT_PRED2(contains, refusal(), "is not a file");
  fs::remove(file);
  std::ofstream(file) << std::string(33, 'k');
  fs::permissions(file, fs::perms::owner_read);
  EXPECT_PRED2(contains, refusal(), "32 bytes");
  EXPECT_PRED2(contains, refusal(), "found 33");
  fs::remove(file);
  ASSERT_TRUE(write_mesh_key(file));
  fs::permissions(file, fs::perms::others_read, fs::perm_options::add);
  EXPECT_PRED2(contains, refusal(), "chmod o=");
}

}  // namespace
}  // namespace crepes::mesh_key_test
