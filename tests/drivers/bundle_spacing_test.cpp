#include "drivers/imu/bundle_spacing.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <chrono>
#include <vector>

namespace crepes::bundle_spacing_test {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds{10};

std::vector<ImuSample> bundle_of(std::size_t count, Timestamp arrival) {
  return std::vector<ImuSample>(count, ImuSample{.stamp = arrival});
}

std::vector<Duration> times_of(const std::vector<ImuSample>& bundle) {
  std::vector<Duration> times;
  for (const ImuSample& sample : bundle) times.push_back(sample.stamp.time_since_epoch());
  return times;
}

TEST(BundleSpacing, LeavesSamplesThatComeOneByOneAsTheyAre) {
  BundleSpacing spacing(kPeriod);
  auto first = bundle_of(1, Timestamp{milliseconds{50}});
  auto second = bundle_of(1, Timestamp{milliseconds{53}});

  spacing.apply(first);
  spacing.apply(second);

  EXPECT_EQ(times_of(first), (std::vector<Duration>{milliseconds{50}}));
  EXPECT_EQ(times_of(second), (std::vector<Duration>{milliseconds{53}}));
}

TEST(BundleSpacing, PutsTheOlderSamplesOfABundleAPeriodApart) {
  BundleSpacing spacing(kPeriod);
  auto bundle = bundle_of(3, Timestamp{milliseconds{50}});

  spacing.apply(bundle);

  EXPECT_EQ(times_of(bundle),
            (std::vector<Duration>{milliseconds{30}, milliseconds{40}, milliseconds{50}}));
}

TEST(BundleSpacing, LeavesStampsOfASensorsOwnClock) {
  BundleSpacing spacing(kPeriod);
  std::vector<ImuSample> bundle{{.stamp = Timestamp{milliseconds{7}}},
                                {.stamp = Timestamp{milliseconds{50}}}};

  spacing.apply(bundle);

  EXPECT_EQ(times_of(bundle), (std::vector<Duration>{milliseconds{7}, milliseconds{50}}));
}

TEST(BundleSpacing, KeepsAnySequenceOfBundlesInOrderAndNeverStampsAfterArrival) {
  EXPECT_TRUE(rc::check([] {
    BundleSpacing spacing(kPeriod);
    Timestamp arrival{};
    Timestamp last{Duration::min()};
    const int bundles = *rc::gen::inRange(1, 30);
    for (int i = 0; i < bundles; ++i) {
      arrival += std::chrono::microseconds{*rc::gen::inRange(1, 40000)};
      auto bundle = bundle_of(*rc::gen::inRange<std::size_t>(0, 6), arrival);

      spacing.apply(bundle);

      for (const ImuSample& sample : bundle) {
        RC_ASSERT(sample.stamp > last);
        RC_ASSERT(sample.stamp <= arrival);
        last = sample.stamp;
      }
    }
  }));
}

}  // namespace
}  // namespace crepes::bundle_spacing_test
