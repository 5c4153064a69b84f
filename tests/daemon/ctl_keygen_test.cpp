#include <gtest/gtest.h>

#include <filesystem>

#include "daemon/ctl/csv_file.hpp"
#include "daemon/ctl/keygen.hpp"
#include "daemon/ctl/scratch_directory.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

TEST(Keygen, WritesThirtyTwoRandomBytesForTheOwnerAlone) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  ASSERT_TRUE(write_mesh_key(scratch.path() / "a"));
  ASSERT_TRUE(write_mesh_key(scratch.path() / "b"));

  const std::string a = read_text_file(scratch.path() / "a").value();
  EXPECT_EQ(a.size(), 32U);
  EXPECT_NE(a, read_text_file(scratch.path() / "b").value());
  EXPECT_EQ(fs::status(scratch.path() / "a").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
}

TEST(Keygen, NeverOverwrites) {
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

TEST(Keygen, LeavesNothingBehindWhereThereIsNoRoom) {
  const auto full = write_mesh_key("/nowhere/key");

  ASSERT_FALSE(full);
  EXPECT_NE(full.error().message.find("/nowhere/key"), std::string::npos);
}

}  // namespace
}  // namespace crepes
