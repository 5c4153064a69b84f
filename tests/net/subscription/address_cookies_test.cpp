#include "net/subscription/address_cookies.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <set>

namespace crepes::address_cookies_test {
namespace {

using std::chrono::seconds;

constexpr Timestamp kStart{seconds{1000}};
constexpr HashKey kKey{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

Endpoint client(std::uint16_t port) { return Endpoint::ipv4({10, 0, 0, 7}, port); }

TEST(AddressCookies, AcceptsItsOwnCookieForAMinuteAtLeastAndTwoAtMost) {
  const AddressCookies mint(kKey);
  const std::string cookie = mint.cookie_for(client(5), kStart);

  EXPECT_TRUE(mint.accepts(cookie, client(5), kStart));
  EXPECT_TRUE(mint.accepts(cookie, client(5), kStart + seconds{60}));
  EXPECT_FALSE(mint.accepts(cookie, client(5), kStart + seconds{120}));
}

TEST(AddressCookies, BindsACookieToOneAddressAndPort) {
  const AddressCookies mint(kKey);
  const std::string cookie = mint.cookie_for(client(5), kStart);

  EXPECT_FALSE(mint.accepts(cookie, client(6), kStart));
  EXPECT_FALSE(mint.accepts(cookie, Endpoint::ipv4({10, 0, 0, 8}, 5), kStart));
  Endpoint link_local{.address = client(5).address, .scope = 2, .port = 5};
  EXPECT_FALSE(mint.accepts(cookie, link_local, kStart));
}

TEST(AddressCookies, RefusesCookiesOfAnotherStart) {
  HashKey other = kKey;
  other[15] ^= 1U;

  EXPECT_FALSE(AddressCookies(other).accepts(AddressCookies(kKey).cookie_for(client(5), kStart),
                                             client(5), kStart));
}

TEST(AddressCookies, RefusesWhatIsNoCookie) {
  const AddressCookies mint(kKey);

  EXPECT_FALSE(mint.accepts("", client(5), kStart));
  EXPECT_FALSE(mint.accepts("0000000000000000", client(5), kStart));
  EXPECT_FALSE(mint.accepts(mint.cookie_for(client(5), kStart) + "0", client(5), kStart));
}

TEST(AddressCookies, IssuesAnotherCookieToEveryClient) {
  const AddressCookies mint(kKey);
  std::set<std::string> cookies;
  for (std::uint16_t port = 1; port <= 1000; ++port)
    cookies.insert(mint.cookie_for(client(port), kStart));

  EXPECT_EQ(cookies.size(), 1000U);
}

// The reference vector of SipHash-2-4 (Aumasson and Bernstein 2012) is over bytes 0 to 14; an
// endpoint, its port and a number are 30 bytes, so this one is of libsodium's own making: it
// guards the layout, which must not change within a start.
TEST(KeyedHash, DependsOnEveryPartOfItsInput) {
  const Endpoint endpoint = client(5);
  const std::uint64_t hash = keyed_hash(kKey, endpoint, 9);

  EXPECT_EQ(hash, keyed_hash(kKey, endpoint, 9));
  EXPECT_NE(hash, keyed_hash(kKey, endpoint, 10));
  EXPECT_NE(hash, keyed_hash(kKey, client(6), 9));
}

}  // namespace
}  // namespace crepes::address_cookies_test
