#include "net/mesh/mesh_relay.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

#include "tests/support/heap.hpp"

namespace crepes::mesh_relay_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::heap_bytes;

constexpr RobotId kSelf{1};
constexpr RobotId kSender{2};
constexpr RobotId kFar{3};
constexpr RobotId kOther{4};
constexpr Timestamp kNow{seconds{100}};
constexpr Timestamp kLater = kNow + milliseconds{60};
const std::vector<std::uint8_t> kBytes{1, 2, 3};

Endpoint address_of(RobotId robot) {
  return Endpoint::ipv4({10, 0, 0, static_cast<std::uint8_t>(robot.value)}, 47474);
}

DatagramId datagram(std::uint32_t sequence = 6) { return {kSender, 77, sequence}; }

/// Hears `heard` directly, at kNow.
MeshRelay relay_that_hears(const std::vector<RobotId>& heard) {
  MeshRelay relay(kSelf);
  for (const RobotId robot : heard) relay.record_heard(robot, address_of(robot), kNow);
  return relay;
}

TEST(MeshRelay, IsNeededByARobotThatDoesNotHearWhatItsNeighborHears) {
  MeshRelay relay = relay_that_hears({kSender});
  EXPECT_FALSE(relay.is_needed(kNow));

  relay.record_hears(kSender, kSelf, kNow);
  EXPECT_FALSE(relay.is_needed(kNow)) << "we hear ourselves";
  relay.record_hears(kSender, kFar, kNow);
  EXPECT_TRUE(relay.is_needed(kNow));

  relay.record_heard(kFar, address_of(kFar), kNow);
  EXPECT_FALSE(relay.is_needed(kNow));
}

TEST(MeshRelay, IsNotNeededForLongOnceNobodyHearsTheFarRobot) {
  MeshRelay relay = relay_that_hears({kSender});
  relay.record_hears(kSender, kFar, kNow);
  relay.record_heard(kSender, address_of(kSender), kNow + seconds{3});

  EXPECT_FALSE(relay.is_needed(kNow + seconds{3}));
}

TEST(MeshRelay, ForwardsOnceWhatANeighborDoesNotHear) {
  MeshRelay relay = relay_that_hears({kSender, kFar});
  relay.record_hears(kFar, kSelf, kNow);

  relay.offer(datagram(), kBytes, address_of(kSender), kNow);

  ASSERT_TRUE(relay.next_due().has_value());
  EXPECT_LE(*relay.next_due(), kLater);
  EXPECT_EQ(relay.take_due(kLater), std::vector<std::vector<std::uint8_t>>{kBytes});
  EXPECT_TRUE(relay.take_due(kLater).empty());
  EXPECT_FALSE(relay.next_due().has_value());
}

TEST(MeshRelay, ForwardsNothingWhereEverybodyHearsTheSender) {
  MeshRelay relay = relay_that_hears({kSender, kFar});
  relay.record_hears(kFar, kSender, kNow);

  relay.offer(datagram(), kBytes, address_of(kSender), kNow);

  EXPECT_TRUE(relay.take_due(kLater).empty());
}

TEST(MeshRelay, LeavesItToOneWhoHasReachedTheSameNeighbors) {
  MeshRelay relay = relay_that_hears({kSender, kFar, kOther});
  relay.record_hears(kOther, kSender, kNow);
  relay.record_hears(kFar, kOther, kNow);

  relay.offer(datagram(6), kBytes, address_of(kSender), kNow);
  EXPECT_TRUE(relay.record_copy(datagram(6), address_of(kOther)));
  EXPECT_TRUE(relay.take_due(kLater).empty());

  relay.offer(datagram(12), kBytes, address_of(kSender), kNow);
  EXPECT_TRUE(relay.record_copy(datagram(12), address_of(kSender))) << "the sender's own, again";
  EXPECT_EQ(relay.take_due(kLater).size(), 1U);
}

TEST(MeshRelay, KnowsWhoForwardedTheFirstCopy) {
  MeshRelay relay = relay_that_hears({kFar, kOther});
  relay.record_hears(kFar, kOther, kNow);

  relay.offer(datagram(), kBytes, address_of(kOther), kNow);

  EXPECT_TRUE(relay.take_due(kLater).empty());
}

TEST(MeshRelay, CountsOnlyCopiesOfWhatWasOffered) {
  MeshRelay relay = relay_that_hears({kSender});
  EXPECT_FALSE(relay.record_copy(datagram(), address_of(kSender)));
}

TEST(MeshRelay, ForwardsAFewDatagramsASecondOfOneSender) {
  MeshRelay relay = relay_that_hears({kSender, kFar});
  std::size_t forwarded = 0;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const Timestamp now = kNow + milliseconds{10} * i;
    relay.offer(datagram(i), kBytes, address_of(kSender), now);
    forwarded += relay.take_due(now).size();
  }
  EXPECT_GT(forwarded, 5U);
  EXPECT_LT(forwarded, 20U);
}

TEST(MeshRelay, StoresNoMoreForAFloodOfCopies) {
  MeshRelay relay = relay_that_hears({kSender, kFar, kOther});
  relay.offer(datagram(), kBytes, address_of(kSender), kNow);
  const std::int64_t before = heap_bytes();

  for (int i = 0; i < 100'000; ++i) ASSERT_TRUE(relay.record_copy(datagram(), address_of(kOther)));

  EXPECT_LT(heap_bytes() - before, 1'000);
}

TEST(MeshRelay, StoresNoMoreForAFloodOfDatagrams) {
  MeshRelay relay = relay_that_hears({kSender, kFar});
  const std::vector<std::uint8_t> longest(1400);
  const std::int64_t before = heap_bytes();

  for (std::uint32_t i = 0; i < 10'000; ++i)
    relay.offer(datagram(i), longest, address_of(kSender), kNow);

  EXPECT_LT(heap_bytes() - before, 256 * 1'600);
}

TEST(MeshRelay, MarksAboutFourDatagramsASecond) {
  EXPECT_EQ(mark_spacing(1), 6U);
  EXPECT_EQ(mark_spacing(3), 2U);
  EXPECT_EQ(mark_spacing(6), 2U) << "what is not marked shows who is heard";
}

}  // namespace
}  // namespace crepes::mesh_relay_test
