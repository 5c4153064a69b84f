#include "daemon/ctl/convert/mcap_writer.hpp"

#include <gtest/gtest.h>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes::mcap_writer_test {
namespace {

std::string written(const std::function<void(McapWriter&)>& fill) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto file = scratch.path() / "out.mcap";
  McapWriter writer = McapWriter::create(file, "test").value();
  fill(writer);
  EXPECT_FALSE(std::filesystem::exists(file)) << "not complete yet";
  EXPECT_TRUE(writer.finish());
  return read_text_file(file).value();
}

TEST(McapWriter, BeginsAndEndsWithTheMagicEvenWithoutMessages) {
  const std::string_view magic{"\x89MCAP0\r\n", 8};

  const std::string file = written([](McapWriter&) {});

  EXPECT_TRUE(file.starts_with(magic));
  EXPECT_TRUE(file.ends_with(magic));
}

TEST(McapWriter, NumbersKindsTopicsAndMessages) {
  written([](McapWriter& writer) {
    const auto kind = writer.add_schema("kind", "{}");
    EXPECT_EQ(kind, 1);
    EXPECT_EQ(writer.add_channel("/a", kind), 1);
    EXPECT_EQ(writer.add_channel("/b", kind), 2);
    writer.write(1, 5, "{}");
    writer.write(2, 6, "{}");
    EXPECT_EQ(writer.messages(), 2U);
  });
}

TEST(McapWriter, ReportsADiskThatTakesNothing) {
  EXPECT_FALSE(McapWriter::create("/proc/nowhere/out.mcap", "test"));
}

}  // namespace
}  // namespace crepes::mcap_writer_test
