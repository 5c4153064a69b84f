#include "daemon/ctl/live/live_screen.hpp"

#include <gtest/gtest.h>

#include <csignal>

namespace crepes::live_screen_test {
namespace {

TEST(StopSignals, EndAProgramInOrderWhoseOutputNobodyReads) {
  {
    StopSignals stop;
    EXPECT_FALSE(stop.requested());

    std::raise(SIGPIPE);

    EXPECT_TRUE(stop.requested());
  }
  const StopSignals unasked;
  std::raise(SIGPIPE);  // would end this process with the scope
}

}  // namespace
}  // namespace crepes::live_screen_test
