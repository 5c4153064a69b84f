#include "drivers/camera/frame_sequence.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace crepes::frame_sequence_test {
namespace {

std::uint64_t missed_in(const std::vector<std::uint64_t>& numbers) {
  FrameSequence sequence;
  for (const std::uint64_t number : numbers) sequence.add(number);
  return sequence.missed();
}

TEST(FrameSequence, CountsWhatIsNotThere) {
  EXPECT_EQ(missed_in({}), 0U);
  EXPECT_EQ(missed_in({7}), 0U);
  EXPECT_EQ(missed_in({7, 8, 9}), 0U);
  EXPECT_EQ(missed_in({7, 9, 10, 14}), 4U);
}

TEST(FrameSequence, FollowsGigEVisionsNumbersFrom65535To1) {
  EXPECT_EQ(missed_in({65534, 65535, 1, 2}), 0U);
  EXPECT_EQ(missed_in({65534, 2}), 2U);
}

TEST(FrameSequence, TakesALeapForACounterThatBeganAnew) {
  EXPECT_EQ(missed_in({7, 8, 500'000, 500'001}), 0U);
  EXPECT_EQ(missed_in({500'000, 3, 4}), 0U);
  EXPECT_EQ(missed_in({0xffff'ffffU, 0}), 0U);
}

}  // namespace
}  // namespace crepes::frame_sequence_test
