#include "tests/fuzz/mesh_target.hpp"

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <utility>

#include "estimator/core/contract.hpp"
#include "net/mesh/crc32.hpp"
#include "net/mesh/packet_seal.hpp"
#include "net/mesh/peer_message_code.hpp"
#include "tests/fuzz/body_changer.hpp"
#include "tests/support/estimator_pair.hpp"

namespace crepes {
namespace {

using test::EstimatorPair;

constexpr std::size_t kChecksum = 4;

/// The datagram with a changed body and a valid checksum; as it was where it becomes too long.
void change_body(FuzzInput& datagram, FuzzBytes& input, int changes) {
  const std::span<const std::uint8_t> body =
      std::span(datagram).subspan(kClearHeader, datagram.size() - kClearHeader - kChecksum);
  wire::CodedBody contents;
  wire::BodyReader reader(body);
  wire::code_body(reader, contents);
  CREPES_EXPECT(!reader.fault(), "the neighbor's own datagrams can be read");
  BodyChanger changer(input, changes);
  wire::code_body(changer, contents);
  wire::BodyWriter writer;
  wire::code_body(writer, contents);
  const std::vector<std::uint8_t> changed = std::move(writer).finished();
  if (kClearHeader + changed.size() + kChecksum + PacketSeal::kOverhead > kMaxPeerMessage) return;
  datagram.resize(kClearHeader);
  datagram.insert(datagram.end(), changed.begin(), changed.end());
  const std::uint32_t sum = crc32(datagram);
  for (std::size_t i = 0; i < kChecksum; ++i)
    datagram.push_back(static_cast<std::uint8_t>(sum >> 8U * i));
}

/// A pair that knows each other, and what has been said since.
class Conversation {
 public:
  Conversation() {
    constexpr Duration kWarmUp = std::chrono::seconds{4};
    pair_.run_for(kWarmUp);
    CREPES_EXPECT(!pair_.found().empty(), "the pair knows each other before it is misled");
  }

  void hear(FuzzBytes& input) {
    constexpr int kMostChanges = 8;
    const int changes = input.next() % kMostChanges;
    const PacketSeal& seal = seal_;
    pair_.run_for(EstimatorPair::kFrame, {.report_period = EstimatorPair::kFrame,
                                          .peer_datagram = [&](FuzzInput& datagram) {
                                            change_body(datagram, input, changes);
                                            datagram = seal.open(seal.seal(datagram)).value();
                                          }});
    for (; checked_ < pair_.found().size(); ++checked_) {
      const GaussianPose& T_B_N = pair_.found()[checked_].pose.T_B_N;
      CREPES_EXPECT(T_B_N.pose.p.allFinite() && T_B_N.pose.q.coeffs().allFinite() &&
                        T_B_N.covariance.allFinite(),
                    "poses are finite");
    }
  }

 private:
  EstimatorPair pair_{1};
  PacketSeal seal_{MeshKey{{7}}};
  std::size_t checked_ = 0;
};

/// Goes on from input to input, so that none pays for the beginning.
class Conversations {
 public:
  [[nodiscard]] Conversation& next() {
    if (heard_++ % kRenewal == 0) {
      present_ = std::make_unique<Conversation>();
      if (is_written()) history_ = std::ofstream(std::getenv(kHistory));
    }
    return *present_;
  }
  void note(std::span<const std::uint8_t> data) {
    if (is_written()) history_ << hex_of(data) << std::endl;  // NOLINT(performance-avoid-endl): now
  }

 private:
  static constexpr const char* kHistory = "CREPES_FUZZ_HISTORY";
  static constexpr std::uint64_t kRenewal = 3000;
  // NOLINTNEXTLINE(concurrency-mt-unsafe): there is one thread
  [[nodiscard]] static bool is_written() { return std::getenv(kHistory) != nullptr; }

  std::uint64_t heard_ = 0;
  std::unique_ptr<Conversation> present_;
  std::ofstream history_;
};

}  // namespace

/// What a datagram leads to later, the next inputs reach.
void run_mesh(std::span<const std::uint8_t> data) {
  static Conversations conversations;
  Conversation& conversation = conversations.next();
  conversations.note(data);
  FuzzBytes input(data);
  conversation.hear(input);
}

/// Each field in turn to each of its extremes, and nothing at all.
std::vector<FuzzInput> mesh_seeds() {
  std::vector<FuzzInput> seeds{FuzzInput(4)};
  constexpr std::uint8_t kFields = 60;
  constexpr std::uint8_t kExtremes = 8;
  for (std::uint8_t field = 0; field < kFields; ++field)
    for (std::uint8_t extreme = 0; extreme < kExtremes; ++extreme)
      seeds.push_back({1, field, extreme, 0x7f, 0x31});
  return seeds;
}

}  // namespace crepes
