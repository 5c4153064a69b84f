#include "net/mesh/mesh_counters.hpp"

#include <gtest/gtest.h>

#include <set>

namespace crepes::mesh_counters_test {
namespace {

using Totals = std::vector<std::pair<std::string, std::uint64_t>>;

TEST(MeshCounters, ListWhatWasCountedInTheOrderOfNames) {
  MeshCounters counters;
  EXPECT_TRUE(counters.totals().empty());
  counters.add(MeshCounter::kSentBytes, 100);
  counters.add(MeshCounter::kReceived);
  counters.add(MeshCounter::kReceived);

  EXPECT_EQ(counters[MeshCounter::kReceived], 2U);
  EXPECT_EQ(counters.totals(), (Totals{{"received", 2}, {"sent_bytes", 100}}));
}

TEST(MeshCounters, NameEachErrorOfAMessageAfterIt) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < kPeerMessageErrorCount; ++i)
    names.insert(name_of(counter_of(static_cast<PeerMessageError>(i))));

  EXPECT_EQ(names.size(), kPeerMessageErrorCount);
  EXPECT_EQ(name_of(counter_of(PeerMessageError::kTooShort)), "refused_too_short");
  EXPECT_EQ(name_of(counter_of(PeerMessageError::kTrailingBytes)), "refused_trailing");
  EXPECT_EQ(name_of(counter_of(PeerMessageError::kBadCovariance)), "refused_bad_covariance");
}

TEST(MeshCounters, AddUpWhatWasRefusedForItsSealOrItsSignature) {
  MeshCounters counters;
  for (const UnsealError error :
       {UnsealError::kNotSealed, UnsealError::kOtherVersion, UnsealError::kNotAuthentic})
    counters.add(counter_of(error));
  counters.add(MeshCounter::kRefusedSealUnexpected);
  counters.add(MeshCounter::kRefusedDamaged);

  counters.add(MeshCounter::kRefusedSignatureWrong);
  counters.add(MeshCounter::kRefusedSignatureMissing);

  EXPECT_EQ(counters.seal_refusals(), 3U);
  EXPECT_EQ(counters.version_refusals(), 1U);
  EXPECT_EQ(counters.signature_refusals(), 2U);
  EXPECT_EQ(name_of(counter_of(UnsealError::kNotSealed)), "refused_seal_missing");
  EXPECT_EQ(name_of(counter_of(UnsealError::kOtherVersion)), "refused_seal_version");
  EXPECT_EQ(name_of(counter_of(UnsealError::kNotAuthentic)), "refused_seal_broken");
}

TEST(MeshCounters, RefusalsAreThoseThatAreCalledSo) {
  for (std::size_t i = 0; i < kMeshCounterCount; ++i) {
    const auto counter = static_cast<MeshCounter>(i);
    EXPECT_EQ(is_refusal(counter), name_of(counter).starts_with("refused")) << name_of(counter);
  }
}

}  // namespace
}  // namespace crepes::mesh_counters_test
