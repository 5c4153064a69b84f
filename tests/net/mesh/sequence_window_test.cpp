#include "net/mesh/sequence_window.hpp"

#include <gtest/gtest.h>

namespace crepes::sequence_window_test {
namespace {

TEST(SequenceWindow, CountsLossesButNotLateDatagrams) {
  SequenceWindow window;
  using Verdict = SequenceWindow::Verdict;

  EXPECT_EQ(window.accept(10, 1000), Verdict::kNew);
  EXPECT_EQ(window.accept(13, 1000), Verdict::kNew);
  EXPECT_EQ(window.lost(), 2U);
  EXPECT_EQ(window.accept(11, 1000), Verdict::kNew);
  EXPECT_EQ(window.accept(11, 1000), Verdict::kDuplicate);
  EXPECT_EQ(window.lost(), 1U);
  EXPECT_EQ(window.accept(1000, 1000), Verdict::kNew);
  EXPECT_EQ(window.accept(13, 1000), Verdict::kTooOld);
  EXPECT_EQ(window.accept(2001, 1000), Verdict::kTooFarAhead);
  EXPECT_EQ(window.received(), 4U);
}

}  // namespace
}  // namespace crepes::sequence_window_test
