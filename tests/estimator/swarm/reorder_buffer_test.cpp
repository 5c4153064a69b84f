#include "estimator/swarm/reorder_buffer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <map>
#include <vector>

namespace crepes::reorder_buffer_test {
namespace {

using namespace std::chrono_literals;

Measurement at(Duration t, double range_m = 1.0) {
  return {Timestamp{t}, MeasurementKind::kRange, RangeReading{range_m, 0.1}};
}

std::vector<std::int64_t> release_all(ReorderBuffer& buffer, Timestamp now) {
  std::vector<std::int64_t> stamps;
  for (auto group = buffer.pop_ready(now); !group.empty(); group = buffer.pop_ready(now))
    for (const Measurement& measurement : group) stamps.push_back(to_ns(measurement.stamp));
  return stamps;
}

TEST(ReorderBuffer, ReleasesLateEventsInOrderWithinTheLag) {
  ReorderBuffer buffer(100ms);
  for (const Duration t : {Duration{30ms}, Duration{10ms}, Duration{20ms}}) {
    ASSERT_TRUE(buffer.push(at(t)));
  }

  EXPECT_TRUE(release_all(buffer, Timestamp{109ms}).empty());
  EXPECT_EQ(release_all(buffer, Timestamp{120ms}),
            (std::vector<std::int64_t>{10'000'000, 20'000'000}));
  ASSERT_EQ(buffer.pending().size(), 1U);
  EXPECT_EQ(buffer.pending()[0].stamp, Timestamp{30ms});
}

TEST(ReorderBuffer, RefusesWhatComesAfterAYoungerOneWasReleased) {
  ReorderBuffer buffer(100ms);
  ASSERT_TRUE(buffer.push(at(20ms)));
  ASSERT_EQ(release_all(buffer, Timestamp{120ms}).size(), 1U);

  EXPECT_FALSE(buffer.push(at(19ms)));
  EXPECT_TRUE(buffer.push(at(20ms)));
}

// Readings arrive every 10 ms, and a reading's delay depends on its number.
template <class Delay>
std::size_t count_late(ReorderBuffer& buffer, Timestamp begin, int count, const Delay& delay) {
  std::map<Timestamp, Duration> arrivals;
  for (int i = 0; i < count; ++i) arrivals[begin + i * 10ms + delay(i)] = begin + i * 10ms - begin;
  std::size_t late = 0;
  for (const auto& [arrival, measured] : arrivals) {
    if (!buffer.push(at(begin.time_since_epoch() + measured))) ++late;
    (void)release_all(buffer, arrival);
  }
  return late;
}

TEST(ReorderBuffer, WaitsLongerWhereReadingsArriveLaterAndShorterAgain) {
  ReorderBuffer buffer(50ms);
  // Up to 200 ms, in any order.
  const auto slow = [](int i) { return Duration{i * 7919 % 200 * 1ms}; };
  const auto fast = [](int) { return Duration{5ms}; };

  (void)count_late(buffer, Timestamp{1s}, 1000, slow);
  EXPECT_LT(count_late(buffer, Timestamp{20s}, 1000, slow), 30U);
  EXPECT_GT(buffer.lag(), 180ms);
  EXPECT_LT(buffer.lag(), 220ms);

  EXPECT_EQ(count_late(buffer, Timestamp{40s}, 10'000, fast), 0U);
  EXPECT_EQ(buffer.lag(), 50ms);
}

TEST(ReorderBuffer, WaitsNoLongerThanHalfASecondWhateverArrives) {
  ReorderBuffer buffer(50ms);

  (void)count_late(buffer, Timestamp{1000s}, 5000, [](int i) { return Duration{i % 2 * 900s}; });

  EXPECT_LE(buffer.lag(), 500ms);
}

TEST(ReorderBuffer, KeepsTheOrderOfArrivalAmongEqualStamps) {
  ReorderBuffer buffer(0ms);
  for (const double range_m : {1.0, 2.0, 3.0}) ASSERT_TRUE(buffer.push(at(10ms, range_m)));

  std::vector<double> ranges;
  for (const Measurement& measurement : buffer.pop_ready(Timestamp{10ms}))
    ranges.push_back(std::get<RangeReading>(measurement.reading).range_m);

  EXPECT_EQ(ranges, (std::vector<double>{1.0, 2.0, 3.0}));
}

TEST(ReorderBuffer, ReleasesCandidatesOfOneInstantTogether) {
  ReorderBuffer buffer(0ms);
  ASSERT_TRUE(buffer.push(at(10ms)));
  ASSERT_TRUE(buffer.push({Timestamp{10ms}, MeasurementKind::kPeerRange, RangeReading{}}));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(buffer.push(at(20ms)));

  EXPECT_EQ(buffer.pop_ready(Timestamp{20ms}).size(), 1U);
  EXPECT_EQ(buffer.pop_ready(Timestamp{20ms}).size(), 1U);
  EXPECT_EQ(buffer.pop_ready(Timestamp{20ms}).size(), 3U);
  EXPECT_TRUE(buffer.pop_ready(Timestamp{20ms}).empty());
}

TEST(ReorderBuffer, IsBoundedAndDropsTheOldest) {
  ReorderBuffer buffer(100ms);
  for (std::size_t i = 0; i < ReorderBuffer::kCapacity + 10; ++i) {
    ASSERT_TRUE(buffer.push(at(static_cast<std::int64_t>(i) * 1ms)));
  }

  EXPECT_EQ(buffer.pending().size(), ReorderBuffer::kCapacity);
  EXPECT_EQ(buffer.dropped(), 10U);
  EXPECT_EQ(buffer.pending().front().stamp, Timestamp{10ms});
}

TEST(ReorderBuffer, WhateverTheOrderOfArrivalReleasesNeverGoBackAndNothingIsLost) {
  EXPECT_TRUE(rc::check([] {
    const auto stamps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 1000));
    ReorderBuffer buffer(50ms);
    std::vector<std::int64_t> released;
    std::size_t refused = 0;
    Timestamp now{};
    for (const int t : stamps) {
      now = std::max(now, Timestamp{t * 1ms});
      if (!buffer.push(at(t * 1ms))) ++refused;
      for (const std::int64_t stamp : release_all(buffer, now)) released.push_back(stamp);
    }

    RC_ASSERT(std::is_sorted(released.begin(), released.end()));
    RC_ASSERT(released.size() + refused + buffer.pending().size() == stamps.size());
  }));
}

}  // namespace
}  // namespace crepes::reorder_buffer_test
