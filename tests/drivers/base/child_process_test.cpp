#include "drivers/base/child_process.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <string>

#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"

namespace crepes::child_process_test {
namespace {

TEST(ChildProcess, ReportsHowItEndedAndKeepsItsOutput) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto log = scratch.path() / "log";
  {
    auto child = ChildProcess::start("/bin/sh", {"-c", "echo said; exit 3"}, log).value();
    while (!child.exit_reason()) {
    }
    EXPECT_EQ(child.exit_reason(), "exit code 3");
  }
  EXPECT_EQ(read_text_file(log).value(), "said\n");
}

TEST(ChildProcess, EndsWithItsOwner) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto log = scratch.path() / "log";
  auto child = std::make_optional(
      ChildProcess::start("/bin/sh", {"-c", "echo $$; exec sleep 100"}, log).value());
  std::string pid;
  while (pid.empty()) pid = read_text_file(log).value_or("");
  pid.pop_back();
  ASSERT_TRUE(std::filesystem::exists("/proc/" + pid));

  child.reset();

  EXPECT_FALSE(std::filesystem::exists("/proc/" + pid));
}

TEST(ChildProcess, NamesAProgramThatIsNotThere) {
  const auto child = ChildProcess::start("/nowhere/crepesd", {}, "/dev/null");

  ASSERT_FALSE(child);
  EXPECT_NE(child.error().message.find("/nowhere/crepesd"), std::string::npos);
}

}  // namespace
}  // namespace crepes::child_process_test
