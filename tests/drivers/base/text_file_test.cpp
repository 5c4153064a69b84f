#include "drivers/base/text_file.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "drivers/base/number_text.hpp"

namespace crepes::text_file_test {
namespace {

class TextFile : public testing::Test {
 protected:
  [[nodiscard]] std::filesystem::path file_of(const std::string& text) const {
    std::ofstream(folder_ / "file", std::ios::binary) << text;
    return folder_ / "file";
  }

  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  const std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) /
      testing::UnitTest::GetInstance()->current_test_info()->name();
};

TEST_F(TextFile, IsReadToItsLastByte) {
  const std::string text = std::string(200'000, 'x') + std::string("\0\r\nend", 6);

  EXPECT_EQ(read_text(file_of(text)).value(), text);
  EXPECT_EQ(read_text_file(file_of("")).value(), "");
}

TEST_F(TextFile, IsRefusedBeyondItsLimit) {
  const std::filesystem::path file = file_of(std::string(kMaxConfigBytes, 'x'));
  EXPECT_EQ(read_text(file, kMaxConfigBytes).value().size(), kMaxConfigBytes);

  std::ofstream(file, std::ios::app) << 'x';
  EXPECT_EQ(read_text(file, kMaxConfigBytes).error().message, "is larger than 1 MiB");
}

TEST_F(TextFile, IsNamedInTheErrorWhenAsked) {
  const std::filesystem::path missing = folder_ / "missing";

  EXPECT_EQ(read_text(missing).error().message, "cannot be opened: No such file or directory");
  EXPECT_EQ(read_text(missing).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(read_text_file(missing).error().message, missing.string() + ": no such file");
  EXPECT_EQ(read_text(folder_).error().message, "is a directory");
  EXPECT_EQ(read_text_file(folder_).error().message, folder_.string() + ": not a file");
}

TEST(NumberText, IsReadAsAWholeOrNotAtAll) {
  int whole = 7;
  EXPECT_EQ(parse_number("12x", whole), "not a number");
  EXPECT_EQ(parse_number("", whole), "not a number");
  EXPECT_EQ(parse_number("99999999999", whole), "number out of range");
  EXPECT_EQ(whole, 7);
  EXPECT_EQ(parse_number("-12", whole), "");
  EXPECT_EQ(whole, -12);

  double value = 0.5;
  EXPECT_EQ(parse_number("nan", value), "not finite");
  EXPECT_EQ(value, 0.5);
}

TEST(NumberText, ReadsBackToTheSameBits) {
  std::string text;
  append_number(text, 0.1 + 0.2);
  double value = 0.0;

  EXPECT_EQ(parse_number(text, value), "");
  EXPECT_EQ(value, 0.1 + 0.2);
}

}  // namespace
}  // namespace crepes::text_file_test
