#include "net/mesh/signature_limiter.hpp"

#include <gtest/gtest.h>

#include <chrono>

namespace crepes {
namespace {

using std::chrono::microseconds;

Endpoint address(std::uint8_t last) { return Endpoint::ipv4({10, 0, 0, last}, 47474); }

/// Verifications in vain that a flood from `count` addresses gets in a second.
int in_vain(SignatureLimiter& limiter, int count, Timestamp from) {
  int verified = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Timestamp now = from + microseconds{10 * i};
    const Endpoint source = address(static_cast<std::uint8_t>(100 + i % count));
    if (!limiter.allows(source, now)) continue;
    limiter.count_in_vain(source, now);
    ++verified;
  }
  return verified;
}

TEST(SignatureLimiter, NeverRefusesAnAddressThatIsAccepted) {
  SignatureLimiter limiter;
  limiter.count_accepted(address(1), Timestamp{});

  EXPECT_LE(in_vain(limiter, 100, Timestamp{}), 702);

  EXPECT_TRUE(limiter.allows(address(1), Timestamp{} + std::chrono::seconds{1}));
  EXPECT_FALSE(limiter.allows(address(150), Timestamp{} + std::chrono::seconds{1}));
  EXPECT_TRUE(limiter.allows(address(150), Timestamp{} + std::chrono::seconds{2}));
}

TEST(SignatureLimiter, LimitsAnAddressThatWasAccepted) {
  SignatureLimiter limiter;
  limiter.count_accepted(address(100), Timestamp{});

  EXPECT_LE(in_vain(limiter, 1, Timestamp{}), 151);
}

TEST(SignatureLimiter, ForgetsTheAddressThatWasSilentForLongest) {
  SignatureLimiter limiter;
  for (std::uint8_t i = 0; i <= SignatureLimiter::kMaxKnown; ++i)
    limiter.count_accepted(address(i), Timestamp{microseconds{i}});
  const Timestamp now{std::chrono::seconds{1}};
  in_vain(limiter, 1, Timestamp{});

  EXPECT_FALSE(limiter.allows(address(0), now));
  EXPECT_TRUE(limiter.allows(address(1), now));
}

}  // namespace
}  // namespace crepes
