#include "net/mesh/packet_seal.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "net/mesh/peer_message.hpp"

namespace crepes::packet_seal_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

const MeshKey kKey{1, 2, 3};
const MeshKey kOtherKey{1, 2, 4};

/// The 18 bytes that a seal leaves readable, then `body`.
Bytes datagram(const Bytes& body, std::uint8_t sequence = 1) {
  Bytes bytes{'C', 'R', 'P', 2, 1, 0, 1, 2, 3, 4, 5, 6, 7, 8, sequence, 0, 0, 0};
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

RC_GTEST_PROP(PacketSeal, GivesBackWhatWasSealed, (const Bytes& body)) {
  const PacketSeal seal(kKey);
  const Bytes plain = datagram(body);

  const Bytes sealed = seal.seal(plain);

  RC_ASSERT(sealed.size() == plain.size() + PacketSeal::kOverhead);
  RC_ASSERT(PacketSeal::is_sealed(sealed));
  RC_ASSERT(seal.open(sealed).value() == plain);
}

TEST(PacketSeal, DoesNotOpenAfterAnyBitError) {
  const PacketSeal seal(kKey);
  const Bytes whole = seal.seal(datagram(Bytes(40, 7)));

  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes changed = whole;
    changed[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_FALSE(seal.open(changed)) << "bit " << bit;
  }
}

TEST(PacketSeal, DoesNotOpenAfterAnyTruncation) {
  const PacketSeal seal(kKey);
  const Bytes whole = seal.seal(datagram(Bytes(40, 7)));

  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(seal.open(std::span(whole).first(size))) << size << " bytes";
}

TEST(PacketSeal, ReportsWhyItDoesNotOpen) {
  const PacketSeal seal(kKey);
  Bytes sealed = seal.seal(datagram(Bytes(40, 7)));

  EXPECT_EQ(seal.open(Bytes{'C', 'R', 'P', 2, 0, 0}).error(), UnsealError::kNotSealed);
  EXPECT_EQ(seal.open(Bytes{}).error(), UnsealError::kNotSealed);
  EXPECT_EQ(PacketSeal(kOtherKey).open(sealed).error(), UnsealError::kNotAuthentic);
  sealed[3] = 1;
  EXPECT_EQ(seal.open(sealed).error(), UnsealError::kOtherVersion);
}

TEST(PacketSeal, HidesThatTwoDatagramsHaveEqualContents) {
  const PacketSeal seal(kKey);

  const Bytes first = seal.seal(datagram(Bytes(80, 7), 1));
  const Bytes second = seal.seal(datagram(Bytes(80, 7), 2));

  std::size_t equal = 0;
  for (std::size_t i = kClearHeader; i < first.size(); ++i) equal += first[i] == second[i] ? 1 : 0;
  EXPECT_LT(equal, 10U);  // of 96; a third of one is what chance brings
}

}  // namespace
}  // namespace crepes::packet_seal_test
