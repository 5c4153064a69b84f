#include "net/mesh/packet_seal.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace crepes {
namespace {

using Bytes = std::vector<std::uint8_t>;

const MeshKey kKey{1, 2, 3};
const MeshKey kOtherKey{1, 2, 4};

RC_GTEST_PROP(PacketSeal, GivesBackWhatWasSealed, (const Bytes& plain)) {
  const PacketSeal seal(kKey);

  const Bytes sealed = seal.seal(plain);

  RC_ASSERT(sealed.size() == plain.size() + PacketSeal::kOverhead);
  RC_ASSERT(PacketSeal::is_sealed(sealed));
  RC_ASSERT(seal.open(sealed).value() == plain);
}

TEST(PacketSeal, DoesNotOpenAfterAnyBitError) {
  const PacketSeal seal(kKey);
  const Bytes whole = seal.seal(Bytes(40, 7));

  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes changed = whole;
    changed[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_FALSE(seal.open(changed)) << "bit " << bit;
  }
}

TEST(PacketSeal, DoesNotOpenAfterAnyTruncation) {
  const PacketSeal seal(kKey);
  const Bytes whole = seal.seal(Bytes(40, 7));

  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(seal.open(std::span(whole).first(size))) << size << " bytes";
}

TEST(PacketSeal, ReportsWhyItDoesNotOpen) {
  const PacketSeal seal(kKey);
  Bytes sealed = seal.seal(Bytes(40, 7));

  EXPECT_EQ(seal.open(Bytes{'C', 'R', 'P', 1, 0, 0}).error(), UnsealError::kNotSealed);
  EXPECT_EQ(seal.open(Bytes{}).error(), UnsealError::kNotSealed);
  EXPECT_EQ(PacketSeal(kOtherKey).open(sealed).error(), UnsealError::kNotAuthentic);
  sealed[3] = 2;
  EXPECT_EQ(seal.open(sealed).error(), UnsealError::kOtherVersion);
}

TEST(PacketSeal, HidesThatTwoDatagramsAreEqual) {
  const PacketSeal seal(kKey);
  const Bytes plain(40, 7);

  const Bytes first = seal.seal(plain);
  const Bytes second = seal.seal(plain);

  std::size_t equal = 0;
  for (std::size_t i = 4; i < first.size(); ++i) equal += first[i] == second[i] ? 1 : 0;
  EXPECT_LT(equal, 10U);  // of 80; a third of one is what chance brings
}

}  // namespace
}  // namespace crepes
