#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/core/contract.hpp"
#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_quantizer.hpp"

namespace crepes {
namespace wire {
namespace {

/// What a datagram leaves out so that it fits.
struct Omission {
  std::int64_t spacing;  ///< ticks from one bearing or range of a neighbor to the next, at least
  std::size_t bearings;  ///< of a neighbor that remain
  std::size_t ranges;
  std::size_t samples;    ///< of the IMU that remain
  bool fewer_estimates;   ///< three datagrams in four have none
  std::size_t neighbors;  ///< that remain
};

/// Ticks between reports.
std::int64_t report_ticks(const WireLimits& limits) {
  return limits.period.count() / kTick / static_cast<std::int64_t>(limits.reports);
}

/// The omissions in the order in which they are tried.
std::vector<Omission> omissions(const CodedBody& body, const WireLimits& limits) {
  // Those since the last datagram at 100 Hz and 25 reports a second, and two more.
  const std::size_t newest_samples = 4 * limits.reports + 2;
  std::vector<Omission> all;
  const std::size_t samples = body.imu.samples.size();
  const std::size_t neighbors = std::min(body.sources.size(), BodyReader::kMaxItems);
  const std::int64_t report = report_ticks(limits);
  std::int64_t spacing = 0;
  for (std::size_t m = 1; m < limits.reports; ++m) {
    const std::size_t n = limits.copies * limits.reports;
    all.push_back({spacing, n, n, samples, false, neighbors});
    // Half a report less than the next multiple, because stamps jitter.
    spacing = static_cast<std::int64_t>(m) * report + report / 2;
  }
  for (std::size_t n = limits.copies; n > 0; --n)
    all.push_back({spacing, n, n, samples, false, neighbors});
  for (std::size_t n = samples; n > newest_samples; n -= std::min<std::size_t>(4, n))
    all.push_back({spacing, 1, 1, n, false, neighbors});
  // By turns, a neighbor's bearings are so rare that the receiver needs two to believe them.
  const bool is_rare = limits.reports > 1;
  for (std::size_t n = neighbors; n > 0; n -= std::max<std::size_t>(n / 10, 1))
    all.push_back({is_rare ? 0 : spacing, is_rare ? 2U : 1U, 1, newest_samples, is_rare, n});
  return all;
}

/// Leaves at least `spacing` between items, which are the newest first. Two of one age are a board
/// and its mirror image, or two cameras: they stay together.
template <class Item>
void thin_out(std::vector<Item>& items, std::int64_t spacing) {
  if (items.empty()) return;
  std::int64_t kept = items.front().age;
  std::erase_if(items, [&](const Item& item) {
    const bool remains = item.age == kept || item.age >= kept + spacing;
    if (remains) kept = item.age;
    return !remains;
  });
}

CodedBody without(CodedBody body, const Omission& omission, std::uint32_t turn_of_datagram) {
  const auto shorten = [](auto& items, std::size_t n) { items.resize(std::min(items.size(), n)); };
  shorten(body.imu.samples, omission.samples);
  if (omission.fewer_estimates && turn_of_datagram % 4 != 0) body.estimates.clear();
  std::vector<CodedSource> remaining;
  const std::size_t count = body.sources.size();
  for (std::size_t i = 0; i < count; ++i) {
    // Each datagram continues where the last one of this size ended.
    const std::size_t turn = (i + count - turn_of_datagram * omission.neighbors % count) % count;
    if (turn >= omission.neighbors) continue;
    CodedSource& source = remaining.emplace_back(std::move(body.sources[i]));
    thin_out(source.ranges, omission.spacing);
    thin_out(source.bearings, omission.spacing);
    shorten(source.ranges, omission.ranges);
    std::size_t kept = std::min(source.bearings.size(), omission.bearings);
    while (kept > 0 && kept < source.bearings.size() &&
           source.bearings[kept].age == source.bearings[kept - 1].age)
      ++kept;
    shorten(source.bearings, kept);
  }
  body.sources = std::move(remaining);
  return body;
}

/// Bearings and ranges that `body` lacks, of the neighbors that it has.
std::size_t copies_without_room(const CodedBody& wanted, const CodedBody& body) {
  std::size_t count = 0;
  for (const CodedSource& kept : body.sources) {
    const auto source = std::ranges::find(wanted.sources, kept.neighbor, &CodedSource::neighbor);
    count += source->bearings.size() - kept.bearings.size();
    count += source->ranges.size() - kept.ranges.size();
  }
  return count;
}

std::vector<std::uint8_t> written(const OutgoingPeerMessage& message, CodedBody& body) {
  BitWriter header;
  for (const std::uint8_t byte : kMagic) header.bits(byte, 8);
  header.bits(kVersion, 8);
  header.bits(message.report.sender.value, 16);
  header.wide_bits(message.session, 64);
  header.bits(message.sequence, 32);
  std::vector<std::uint8_t> bytes = std::move(header).finished();
  BodyWriter writer;
  code_body(writer, body);
  const std::vector<std::uint8_t> code = std::move(writer).finished();
  bytes.insert(bytes.end(), code.begin(), code.end());
  BitWriter checksum;
  checksum.bits(crc32(bytes), 32);
  const std::vector<std::uint8_t> sum = std::move(checksum).finished();
  bytes.insert(bytes.end(), sum.begin(), sum.end());
  return bytes;
}

}  // namespace
}  // namespace wire

EncodedPeerMessage encode_peer_message(const OutgoingPeerMessage& message,
                                       const WireLimits& limits) {
  CREPES_EXPECT(limits.bytes >= kMinPeerMessage && limits.bytes <= kMaxPeerMessage,
                "what a datagram cannot do without has room");
  CREPES_EXPECT(limits.copies > 0 && limits.reports > 0, "every measurement is sent");
  CREPES_EXPECT(wire::is_robot(message.report.sender), "a sender has an id");
  CREPES_EXPECT(message.mark >> wire::kMarkBits == 0, "marks are of a few datagrams");
  CREPES_EXPECT(std::abs(to_ns(message.sent)) <= wire::kMaxStamp, "a clock counts from its epoch");
  const auto [whole, refused] = wire::quantized(message, limits);
  EncodedPeerMessage encoded;
  encoded.refused = refused;
  std::optional<wire::CodedBody> wanted;  // the first that is tried
  for (const wire::Omission& omission : wire::omissions(whole, limits)) {
    wire::CodedBody body = wire::without(whole, omission, wire::turn_of(message));
    encoded.bytes = wire::written(message, body);
    if (!wanted) wanted = body;
    encoded.left_out = whole.sources.size() - body.sources.size();
    encoded.left_out_copies = wire::copies_without_room(*wanted, body);
    encoded.left_out_samples = whole.imu.samples.size() - body.imu.samples.size();
    if (encoded.bytes.size() <= limits.bytes) break;
  }
  CREPES_EXPECT(encoded.bytes.size() <= kMaxPeerMessage, "the least fits into a datagram");
  return encoded;
}

}  // namespace crepes
