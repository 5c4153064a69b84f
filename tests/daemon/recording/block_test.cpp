#include "daemon/recording/block.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <string>

namespace crepes::block_test {
namespace {

TEST(BlockStream, ReadsWhyADaemonHungUpBeforeItWasAsked) {
  std::array<int, 2> ends{};
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()), 0);
  BlockStream daemon{UniqueFd(ends[0])};
  {
    const UniqueFd other(ends[1]);
    std::string text;
    append_block(text, "refused", "too many tools are connected");
    ASSERT_GT(::send(other.get(), text.data(), text.size(), 0), 0);
  }

  ASSERT_TRUE(daemon.request("RECORD 1"));
  ASSERT_TRUE(daemon.receive(0));
  const auto block = daemon.next();

  ASSERT_TRUE(block && *block);
  EXPECT_EQ((*block)->kind, "refused");
  EXPECT_EQ((*block)->content, "too many tools are connected");
  EXPECT_FALSE(daemon.receive(0).value()) << "the end";
}

}  // namespace
}  // namespace crepes::block_test
