#include "net/mesh/signature_limiter.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes::signature_limiter_test {
namespace {

using std::chrono::microseconds;

constexpr RobotId kOne{1};
constexpr RobotId kTwo{2};
constexpr RobotId kInsider{3};

Endpoint address(std::uint8_t last) { return Endpoint::ipv4({10, 0, 0, last}, 47474); }

/// Verifications in vain that a flood of `per_s` in a sender's name gets in a second.
int in_vain(SignatureLimiter& limiter, const Endpoint& source, RobotId sender, int per_s = 100'000,
            Timestamp from = {}) {
  int verified = 0;
  for (int i = 0; i < per_s; ++i) {
    const Timestamp now = from + microseconds{1'000'000LL * i / per_s};
    if (!limiter.allows(source, sender, now)) continue;
    limiter.count_in_vain(source, sender, now);
    ++verified;
  }
  return verified;
}

constexpr Timestamp kAfter{std::chrono::seconds{1}};

TEST(SignatureLimiter, NeverRefusesASourceThatIsAcceptedForWhatComesFromElsewhere) {
  SignatureLimiter limiter;
  limiter.count_accepted(address(1), kOne, Timestamp{});

  EXPECT_LE(in_vain(limiter, address(100), kOne), 702);

  EXPECT_TRUE(limiter.allows(address(1), kOne, kAfter));
  EXPECT_FALSE(limiter.allows(address(150), kOne, kAfter));
  EXPECT_TRUE(limiter.allows(address(150), kOne, kAfter + std::chrono::seconds{1}));
}

TEST(SignatureLimiter, HearsASourceInWhoseNameAChannelFullOfFalseOnesComes) {
  SignatureLimiter limiter;
  limiter.count_accepted(address(1), kOne, Timestamp{});

  for (int second = 0; second < 10; ++second)  // 6 Mbit/s carry 1400 of 400 bytes
    EXPECT_EQ(in_vain(limiter, address(1), kOne, 1400, Timestamp{std::chrono::seconds{second}}),
              1400);

  EXPECT_TRUE(limiter.allows(address(1), kOne, Timestamp{std::chrono::seconds{10}}));
}

TEST(SignatureLimiter, BoundsWhatAFloodInASourcesNameCostsAndSparesTheOthers) {
  SignatureLimiter limiter;
  limiter.count_accepted(address(1), kOne, Timestamp{});
  limiter.count_accepted(address(2), kTwo, Timestamp{});

  EXPECT_LE(in_vain(limiter, address(1), kOne), 1500 + 300 + 50 + 100 + 2);

  EXPECT_FALSE(limiter.allows(address(1), kOne, kAfter));
  EXPECT_TRUE(limiter.allows(address(2), kTwo, kAfter));
  in_vain(limiter, address(1), kTwo, 100'000, kAfter);
  EXPECT_TRUE(limiter.allows(address(2), kTwo, kAfter + std::chrono::seconds{1}));
}

TEST(SignatureLimiter, ForgetsTheAddressOfASenderThatWasSilentForLongest) {
  SignatureLimiter limiter;
  limiter.count_accepted(address(1), kOne, Timestamp{});
  for (std::uint8_t i = 0; i <= SignatureLimiter::kMaxAddresses; ++i)
    limiter.count_accepted(address(10 + i), kInsider, Timestamp{microseconds{i}});
  in_vain(limiter, address(200), kTwo);  // what comes from elsewhere is exhausted

  EXPECT_FALSE(limiter.allows(address(10), kInsider, kAfter));
  EXPECT_TRUE(limiter.allows(address(11), kInsider, kAfter));
  EXPECT_TRUE(limiter.allows(address(1), kOne, kAfter)) << "the insider displaces only his own";
}

}  // namespace
}  // namespace crepes::signature_limiter_test
