#include "daemon/stages/bounded_queue.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <chrono>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "daemon/stages/counters.hpp"
#include "daemon/stages/worker.hpp"

namespace crepes::bounded_queue_test {
namespace {

using namespace std::chrono_literals;

std::vector<int> drain(BoundedQueue<int>& queue) {
  std::vector<int> values;
  while (const auto value = queue.try_pop()) values.push_back(*value);
  return values;
}

TEST(BoundedQueue, DropsTheOldestValueWhenFullAndCountsIt) {
  BoundedQueue<int> queue{3, Overflow::kDropOldest};

  for (const int value : {1, 2, 3, 4, 5}) queue.push(value);

  EXPECT_EQ(drain(queue), (std::vector{3, 4, 5}));
  EXPECT_EQ(queue.dropped(), 2U);
}

TEST(BoundedQueue, DropsTheNewestValueWhenFullAndCountsIt) {
  BoundedQueue<int> queue{3, Overflow::kDropNewest};

  for (const int value : {1, 2, 3, 4, 5}) queue.push(value);

  EXPECT_EQ(drain(queue), (std::vector{1, 2, 3}));
  EXPECT_EQ(queue.dropped(), 2U);
}

TEST(BoundedQueue, HoldsTheLastValuesOfAnySequenceAndCountsTheRest) {
  EXPECT_TRUE(rc::check([](const std::vector<int>& values) {
    const std::size_t capacity = *rc::gen::inRange<std::size_t>(1, 20);
    BoundedQueue<int> queue{capacity, Overflow::kDropOldest};

    for (const int value : values) queue.push(value);

    const std::size_t kept = std::min(capacity, values.size());
    RC_ASSERT(queue.dropped() == values.size() - kept);
    RC_ASSERT(drain(queue) ==
              std::vector<int>(values.end() - static_cast<std::ptrdiff_t>(kept), values.end()));
  }));
}

TEST(BoundedQueue, CarriesValuesThatCanOnlyBeMoved) {
  BoundedQueue<std::unique_ptr<int>> queue{1, Overflow::kDropOldest};

  queue.push(std::make_unique<int>(7));

  EXPECT_EQ(**queue.pop(std::stop_token{}), 7);
}

TEST(BoundedQueue, GivesNothingWhenStoppedEvenIfValuesWait) {
  BoundedQueue<int> queue{2, Overflow::kDropOldest};
  std::stop_source stop;
  queue.push(1);

  stop.request_stop();

  EXPECT_EQ(queue.pop(stop.get_token()), std::nullopt);
  EXPECT_EQ(queue.pop_for(10s, stop.get_token()), std::nullopt);
}

TEST(BoundedQueue, GivesUpWaitingAfterTheTimeout) {
  BoundedQueue<int> queue{1, Overflow::kDropOldest};

  EXPECT_EQ(queue.pop_for(1ms, std::stop_token{}), std::nullopt);
  EXPECT_EQ(queue.pop_for(-1ms, std::stop_token{}), std::nullopt);
}

TEST(BoundedQueue, LetsAWaitingThreadGoWhenItIsStopped) {
  BoundedQueue<int> queue{1, Overflow::kDropOldest};
  Counter returned;
  {
    const Worker waiting("waiting", [&](const std::stop_token& stop) {
      while (queue.pop(stop)) continue;
      returned.add();
    });
    const Worker waiting_long("waiting long", [&](const std::stop_token& stop) {
      while (queue.pop_for(24h, stop)) continue;
      returned.add();
    });
  }  // would hang here

  EXPECT_EQ(returned.value(), 2U);
}

TEST(BoundedQueue, LosesNothingBetweenManyProducersAndOneConsumer) {
  constexpr int kEach = 5000;
  BoundedQueue<int> queue{2 * kEach, Overflow::kDropNewest};
  const auto produce = [&queue](const std::stop_token&) {
    for (int i = 1; i <= kEach; ++i) queue.push(i);
  };

  const Worker first("first", produce);
  const Worker second("second", produce);
  std::int64_t sum = 0;
  for (int i = 0; i < 2 * kEach; ++i) sum += *queue.pop(std::stop_token{});

  EXPECT_EQ(sum, std::int64_t{kEach} * (kEach + 1));
  EXPECT_EQ(queue.dropped(), 0U);
}

TEST(BoundedQueueDeathTest, RefusesToBeWithoutCapacity) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");

  EXPECT_DEATH((BoundedQueue<int>{0, Overflow::kDropOldest}), "at least one value");
}

}  // namespace
}  // namespace crepes::bounded_queue_test
