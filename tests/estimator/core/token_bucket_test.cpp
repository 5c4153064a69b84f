#include "estimator/core/token_bucket.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes::token_bucket_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};

TEST(TokenBucket, AllowsItsBurstAndThenItsRate) {
  TokenBucket bucket({.per_s = 10, .burst = 3});

  EXPECT_TRUE(bucket.try_consume(kStart));
  EXPECT_TRUE(bucket.try_consume(kStart));
  EXPECT_TRUE(bucket.try_consume(kStart));
  EXPECT_FALSE(bucket.try_consume(kStart));
  EXPECT_FALSE(bucket.try_consume(kStart + milliseconds{99}));
  EXPECT_TRUE(bucket.try_consume(kStart + milliseconds{101}));
  EXPECT_FALSE(bucket.try_consume(kStart + milliseconds{102}));
}

TEST(TokenBucket, AccruesNoMoreThanItsBurst) {
  TokenBucket bucket({.per_s = 10, .burst = 2});
  ASSERT_TRUE(bucket.try_consume(kStart));

  EXPECT_TRUE(bucket.try_consume(kStart + seconds{100}));
  EXPECT_TRUE(bucket.try_consume(kStart + seconds{100}));
  EXPECT_FALSE(bucket.try_consume(kStart + seconds{100}));
}

TEST(TokenBucket, AddsNothingWhenTimeGoesBackAndForthAgain) {
  TokenBucket bucket({.per_s = 10, .burst = 1});
  ASSERT_TRUE(bucket.try_consume(kStart));

  EXPECT_FALSE(bucket.try_consume(kStart - seconds{5}));
  EXPECT_FALSE(bucket.try_consume(kStart));
}

TEST(TokenBucket, KeepsAReserve) {
  TokenBucket bucket({.per_s = 10, .burst = 3});

  EXPECT_TRUE(bucket.try_consume(kStart, 2.0));
  EXPECT_FALSE(bucket.try_consume(kStart, 2.0));
  EXPECT_TRUE(bucket.try_consume(kStart, 1.0));
}

TEST(TokenBucket, PaysBackWhatWasConsumedInExcess) {
  TokenBucket bucket({.per_s = 10, .burst = 3});
  EXPECT_DOUBLE_EQ(bucket.refill(kStart), 3.0);
  bucket.consume(8.0);

  EXPECT_DOUBLE_EQ(bucket.refill(kStart + milliseconds{400}), -1.0);
  EXPECT_DOUBLE_EQ(bucket.refill(kStart + milliseconds{900}), 3.0);
  EXPECT_DOUBLE_EQ(bucket.fill(), 1.0);
}

}  // namespace
}  // namespace crepes::token_bucket_test
