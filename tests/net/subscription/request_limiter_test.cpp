#include "net/subscription/request_limiter.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes::request_limiter_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};

Endpoint local(int port) {
  return Endpoint::ipv4({127, 0, 0, 1}, static_cast<std::uint16_t>(port));
}
Endpoint remote(int host) {
  return Endpoint::ipv4(
      {10, 0, static_cast<std::uint8_t>(host / 256), static_cast<std::uint8_t>(host % 256)}, 4000);
}

TEST(RequestLimiter, LimitsOneClientWithoutLimitingAnother) {
  RequestLimiter limiter(HashKey{});
  int admitted = 0;
  for (int i = 0; i < 10'000; ++i)
    admitted += limiter.allows(local(1), kStart + milliseconds{i}) ? 1 : 0;

  EXPECT_NEAR(admitted, 600, 5);  // a burst of 100 and 50 a second for ten seconds
  EXPECT_TRUE(limiter.allows(local(2), kStart + seconds{10}));
}

TEST(RequestLimiter, LimitsAllClientsTogether) {
  RequestLimiter limiter(HashKey{});
  int admitted = 0;
  for (int i = 0; i < 60'000; ++i) admitted += limiter.allows(remote(i), kStart) ? 1 : 0;

  EXPECT_EQ(admitted, 200);
}

TEST(RequestLimiter, AdmitsANewClientDuringFloodsOfOthers) {
  RequestLimiter limiter(HashKey{});
  int newcomers = 0;
  for (int ms = 0; ms < 10'000; ++ms) {
    const Timestamp now = kStart + milliseconds{ms};
    for (int i = 0; i < 64; ++i) (void)limiter.allows(local(1000 + i), now);
    if (ms % 1000 == 999) newcomers += limiter.allows(local(2000 + ms), now) ? 1 : 0;
  }

  EXPECT_EQ(newcomers, 10);
}

TEST(RequestLimiter, RarelyStarvesANewClientBySharedBuckets) {
  // Sixty-four floods empty one bucket in sixteen. Both of a newcomer's are among them once in 256.
  RequestLimiter limiter(HashKey{});
  int admitted = 0;
  int newcomers = 0;
  for (int ms = 0; ms < 10'000; ++ms) {
    const Timestamp now = kStart + milliseconds{ms};
    for (int i = 0; i < 128; ++i) (void)limiter.allows(local(1000 + i % 64), now);
    if (ms < 1000 || ms % 3 != 0) continue;
    ++newcomers;
    admitted += limiter.allows(local(2000 + ms), now) ? 1 : 0;
  }

  EXPECT_EQ(newcomers, 3000);
  EXPECT_GT(admitted, 3000 * 0.98);
}

TEST(RequestLimiter, ReservesTokensForThisMachineDuringRemoteFloods) {
  RequestLimiter limiter(HashKey{});
  for (int i = 0; i < 60'000; ++i) (void)limiter.allows(remote(i), kStart);

  EXPECT_TRUE(limiter.allows(local(1), kStart));
}

}  // namespace
}  // namespace crepes::request_limiter_test
