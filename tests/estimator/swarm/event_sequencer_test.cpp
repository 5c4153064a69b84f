#include "estimator/swarm/event_sequencer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <vector>

namespace crepes {
namespace {

using namespace std::chrono_literals;

Measurement at(Duration t, double range_m = 1.0) {
  return {Timestamp{t}, MeasurementKind::kRange, RangeReading{range_m, 0.1}};
}

std::vector<std::int64_t> release_all(EventSequencer& sequencer, Timestamp now) {
  std::vector<std::int64_t> stamps;
  for (auto group = sequencer.pop_ready(now); !group.empty(); group = sequencer.pop_ready(now))
    for (const Measurement& measurement : group) stamps.push_back(to_ns(measurement.stamp));
  return stamps;
}

TEST(EventSequencer, ReleasesLateEventsInOrderWithinTheLag) {
  EventSequencer sequencer(100ms);
  for (const Duration t : {Duration{30ms}, Duration{10ms}, Duration{20ms}}) {
    ASSERT_TRUE(sequencer.push(at(t)));
  }

  EXPECT_TRUE(release_all(sequencer, Timestamp{109ms}).empty());
  EXPECT_EQ(release_all(sequencer, Timestamp{120ms}),
            (std::vector<std::int64_t>{10'000'000, 20'000'000}));
  ASSERT_EQ(sequencer.pending().size(), 1U);
  EXPECT_EQ(sequencer.pending()[0].stamp, Timestamp{30ms});
}

TEST(EventSequencer, RefusesWhatComesAfterAYoungerOneWasReleased) {
  EventSequencer sequencer(100ms);
  ASSERT_TRUE(sequencer.push(at(20ms)));
  ASSERT_EQ(release_all(sequencer, Timestamp{120ms}).size(), 1U);

  EXPECT_FALSE(sequencer.push(at(19ms)));
  EXPECT_TRUE(sequencer.push(at(20ms)));
}

TEST(EventSequencer, KeepsTheOrderOfArrivalAmongEqualStamps) {
  EventSequencer sequencer(0ms);
  for (const double range_m : {1.0, 2.0, 3.0}) ASSERT_TRUE(sequencer.push(at(10ms, range_m)));

  std::vector<double> ranges;
  for (const Measurement& measurement : sequencer.pop_ready(Timestamp{10ms}))
    ranges.push_back(std::get<RangeReading>(measurement.reading).range_m);

  EXPECT_EQ(ranges, (std::vector<double>{1.0, 2.0, 3.0}));
}

TEST(EventSequencer, ReleasesCandidatesOfOneInstantTogether) {
  EventSequencer sequencer(0ms);
  ASSERT_TRUE(sequencer.push(at(10ms)));
  ASSERT_TRUE(sequencer.push({Timestamp{10ms}, MeasurementKind::kPeerRange, RangeReading{}}));
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(sequencer.push(at(20ms)));

  EXPECT_EQ(sequencer.pop_ready(Timestamp{20ms}).size(), 1U);
  EXPECT_EQ(sequencer.pop_ready(Timestamp{20ms}).size(), 1U);
  EXPECT_EQ(sequencer.pop_ready(Timestamp{20ms}).size(), 3U);
  EXPECT_TRUE(sequencer.pop_ready(Timestamp{20ms}).empty());
}

TEST(EventSequencer, IsBoundedAndDropsTheOldest) {
  EventSequencer sequencer(100ms);
  for (std::size_t i = 0; i < EventSequencer::kCapacity + 10; ++i) {
    ASSERT_TRUE(sequencer.push(at(static_cast<std::int64_t>(i) * 1ms)));
  }

  EXPECT_EQ(sequencer.pending().size(), EventSequencer::kCapacity);
  EXPECT_EQ(sequencer.dropped(), 10U);
  EXPECT_EQ(sequencer.pending().front().stamp, Timestamp{10ms});
}

TEST(EventSequencer, WhateverTheOrderOfArrivalReleasesNeverGoBackAndNothingIsLost) {
  EXPECT_TRUE(rc::check([] {
    const auto stamps = *rc::gen::container<std::vector<int>>(rc::gen::inRange(0, 1000));
    EventSequencer sequencer(50ms);
    std::vector<std::int64_t> released;
    std::size_t refused = 0;
    Timestamp now{};
    for (const int t : stamps) {
      now = std::max(now, Timestamp{t * 1ms});
      if (!sequencer.push(at(t * 1ms))) ++refused;
      for (const std::int64_t stamp : release_all(sequencer, now)) released.push_back(stamp);
    }

    RC_ASSERT(std::is_sorted(released.begin(), released.end()));
    RC_ASSERT(released.size() + refused + sequencer.pending().size() == stamps.size());
  }));
}

}  // namespace
}  // namespace crepes
