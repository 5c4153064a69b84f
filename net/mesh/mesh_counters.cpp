#include "net/mesh/mesh_counters.hpp"

#include <algorithm>

namespace crepes {
namespace {

using enum MeshCounter;

constexpr auto kNames = std::to_array<std::string_view>({"forwarded",
                                                         "forwarded_bytes",
                                                         "held_clock_unknown",
                                                         "left_out_copies",
                                                         "left_out_of_datagrams",
                                                         "left_out_samples",
                                                         "received",
                                                         "received_again",
                                                         "received_bytes",
                                                         "refused_bad_covariance",
                                                         "refused_bad_id",
                                                         "refused_bad_index",
                                                         "refused_bad_stamp",
                                                         "refused_clock_jump",
                                                         "refused_damaged",
                                                         "refused_doubled_id",
                                                         "refused_duplicate",
                                                         "refused_echo",
                                                         "refused_excluded",
                                                         "refused_foreign",
                                                         "refused_not_unit",
                                                         "refused_old_session",
                                                         "refused_other_version",
                                                         "refused_out_of_range",
                                                         "refused_own_id",
                                                         "refused_seal_broken",
                                                         "refused_seal_missing",
                                                         "refused_seal_unexpected",
                                                         "refused_seal_version",
                                                         "refused_signature_missing",
                                                         "refused_signature_unchecked",
                                                         "refused_signature_wrong",
                                                         "refused_to_send",
                                                         "refused_too_far_ahead",
                                                         "refused_too_long",
                                                         "refused_too_old",
                                                         "refused_too_short",
                                                         "refused_trailing",
                                                         "refused_truncated",
                                                         "refused_unknown_sender",
                                                         "sent",
                                                         "sent_bytes"});
// STATUS and report.json list the counters in this order.
static_assert(std::ranges::is_sorted(kNames));
static_assert(kNames.size() == kMeshCounterCount &&
              static_cast<std::size_t>(kSentBytes) + 1 == kMeshCounterCount);

// In the order of PeerMessageError and of UnsealError.
constexpr std::array<MeshCounter, kPeerMessageErrorCount> kOfMessageErrors{
    kRefusedTooShort,     kRefusedTooLong,   kRefusedForeign,    kRefusedOtherVersion,
    kRefusedDamaged,      kRefusedTruncated, kRefusedTrailing,   kRefusedBadId,
    kRefusedBadStamp,     kRefusedBadIndex,  kRefusedOutOfRange, kRefusedNotUnit,
    kRefusedBadCovariance};
constexpr std::array<MeshCounter, 3> kOfUnsealErrors{kRefusedSealMissing, kRefusedSealVersion,
                                                     kRefusedSealBroken};

}  // namespace

std::string_view name_of(MeshCounter counter) {
  return kNames.at(static_cast<std::size_t>(counter));
}

MeshCounter counter_of(PeerMessageError error) {
  return kOfMessageErrors.at(static_cast<std::size_t>(error));
}

MeshCounter counter_of(UnsealError error) {
  return kOfUnsealErrors.at(static_cast<std::size_t>(error));
}

std::uint64_t MeshCounters::seal_refusals() const {
  const MeshCounters& totals = *this;
  return totals[kRefusedSealBroken] + totals[kRefusedSealMissing] + totals[kRefusedSealUnexpected];
}

std::uint64_t MeshCounters::version_refusals() const {
  const MeshCounters& totals = *this;
  return totals[kRefusedSealVersion] + totals[kRefusedOtherVersion];
}

std::uint64_t MeshCounters::signature_refusals() const {
  const MeshCounters& totals = *this;
  return totals[kRefusedSignatureMissing] + totals[kRefusedSignatureUnchecked] +
         totals[kRefusedSignatureWrong];
}

std::vector<std::pair<std::string, std::uint64_t>> MeshCounters::totals() const {
  std::vector<std::pair<std::string, std::uint64_t>> named;
  for (std::size_t i = 0; i < kMeshCounterCount; ++i)
    if (totals_.at(i) > 0) named.emplace_back(kNames.at(i), totals_.at(i));
  return named;
}

}  // namespace crepes
