#include "drivers/dataset/part_file.hpp"

#include <gtest/gtest.h>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes::part_file_test {
namespace {

namespace fs = std::filesystem;

class PartFiles : public testing::Test {
 protected:
  void SetUp() override {
    auto folder = ScratchDirectory::create("");
    ASSERT_TRUE(folder) << folder.error().message;
    folder_.emplace(std::move(*folder));
  }
  [[nodiscard]] fs::path path(const std::string& name) const { return folder_->path() / name; }
  static std::string text_of(const fs::path& file) { return read_text(file).value_or("none"); }

  std::optional<ScratchDirectory> folder_;
};

TEST_F(PartFiles, HaveTheirNameOnlyWhenTheyAreComplete) {
  ASSERT_TRUE(replace_text_file(path("a"), "before"));
  auto file = PartFile::create(path("a"), "head,");
  ASSERT_TRUE(file);
  file->text() += "row";

  EXPECT_EQ(text_of(path("a")), "before");
  EXPECT_TRUE(file->publish());
  EXPECT_EQ(text_of(path("a")), "head,row");
  EXPECT_FALSE(fs::exists(path("a.part")));
}

TEST_F(PartFiles, ReplaceWhatALinkLeadsToAndNotTheLink) {
  ASSERT_TRUE(replace_text_file(path("a"), "before"));
  fs::create_symlink("a", path("link"));

  EXPECT_TRUE(replace_text_file(path("link"), "after"));

  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(text_of(path("a")), "after");
}

TEST_F(PartFiles, AreWrittenThroughToADevice) {
  fs::create_symlink("/dev/null", path("null"));
  fs::create_symlink("/dev/full", path("full"));

  auto file = PartFile::create(path("null"), "head");
  ASSERT_TRUE(file);
  EXPECT_TRUE(file->publish());
  EXPECT_FALSE(PartFile::create(path("full"), "head"));

  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  EXPECT_TRUE(fs::is_symlink(path("null")));
}

TEST_F(PartFiles, LeaveNothingBehindThatCannotBeWritten) {
  fs::create_symlink("/dev/full", path("a.part"));

  EXPECT_FALSE(PartFile::create(path("a"), "head"));

  EXPECT_FALSE(fs::is_symlink(path("a.part")));
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

}  // namespace
}  // namespace crepes::part_file_test
