#include "net/mesh/mesh_relay.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace crepes {
namespace {

// Every second datagram may be marked, and every second one lost.
constexpr Duration kHeardFor = std::chrono::seconds{1};
constexpr int kHeardForPeriods = 16;
// Echoes are by turns.
constexpr Duration kHearsFor = std::chrono::seconds{2};
constexpr int kHearsForPeriods = 24;
constexpr Duration kOfferMemory = std::chrono::seconds{1};
constexpr std::size_t kMaxOffers = 256;
constexpr double kWait = 0.1;          // s, at most, divided by the robots that it would reach
constexpr double kLongestWait = 0.03;  // s

/// In [0, 1); differs between robots and datagrams (SplitMix64, Steele et al. 2014).
double drawn(RobotId self, const DatagramId& id) {
  std::uint64_t x = id.session + (std::uint64_t{id.sequence} << 32U) + self.value;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return static_cast<double>((x ^ (x >> 31U)) >> 11U) * 0x1p-53;
}

bool is_recent(Timestamp at, Timestamp now, Duration age) { return at + age >= now; }

}  // namespace

std::uint32_t mark_spacing(std::size_t reports) {
  constexpr std::size_t kReports = 6;
  return static_cast<std::uint32_t>(std::max<std::size_t>(kReports / reports, 2));
}

bool MeshRelay::is_in_reach(const Neighbor& neighbor, Timestamp now) const {
  return is_recent(neighbor.heard, now, std::max(kHeardFor, kHeardForPeriods * period_));
}

bool MeshRelay::is_believed(Timestamp said, Timestamp now) const {
  return is_recent(said, now, std::max(kHearsFor, kHearsForPeriods * period_));
}

bool MeshRelay::is_heard(RobotId sender, Timestamp now) const {
  const auto known = neighbors_.find(sender);
  return known != neighbors_.end() && is_in_reach(known->second, now);
}

bool MeshRelay::is_neighbor(const Endpoint& address) const {
  return std::ranges::any_of(
      neighbors_, [&](const auto& neighbor) { return neighbor.second.address == address; });
}

bool MeshRelay::is_needed(Timestamp now) const {
  return std::ranges::any_of(neighbors_, [&](const auto& neighbor) {
    return is_in_reach(neighbor.second, now) &&
           std::ranges::any_of(neighbor.second.hears, [&](const auto& other) {
             return is_believed(other.second, now) && other.first != self_ &&
                    !is_heard(other.first, now);
           });
  });
}

std::size_t MeshRelay::missed_by(const std::vector<RobotId>& sent_by, Timestamp now) const {
  const auto hears_one = [&](const Neighbor& neighbor) {
    return std::ranges::any_of(sent_by, [&](RobotId sender) {
      const auto hears = neighbor.hears.find(sender);
      return hears != neighbor.hears.end() && is_believed(hears->second, now);
    });
  };
  const auto count = std::ranges::count_if(neighbors_, [&](const auto& neighbor) {
    return is_in_reach(neighbor.second, now) &&
           std::ranges::find(sent_by, neighbor.first) == sent_by.end() &&
           !hears_one(neighbor.second);
  });
  return static_cast<std::size_t>(count);
}

void MeshRelay::record_sent(Offer& offer, const Endpoint& from) const {
  for (const auto& [id, neighbor] : neighbors_)
    if (neighbor.address == from && std::ranges::find(offer.sent_by, id) == offer.sent_by.end())
      offer.sent_by.push_back(id);
}

void MeshRelay::offer(const DatagramId& id, std::span<const std::uint8_t> bytes,
                      const Endpoint& from, Timestamp now) {
  offers_.push_front(
      {.id = id, .at = now, .sent_by = {id.sender}, .bytes = {bytes.begin(), bytes.end()}});
  Offer& offer = offers_.front();
  record_sent(offer, from);
  const auto missed = static_cast<double>(missed_by(offer.sent_by, now));
  offer.due = now + from_seconds(drawn(self_, id) * std::min(kLongestWait, kWait / missed));
  while (offers_.size() > kMaxOffers || !is_recent(offers_.back().at, now, kOfferMemory))
    offers_.pop_back();
}

bool MeshRelay::record_copy(const DatagramId& id, const Endpoint& from) {
  const auto offer = std::ranges::find(offers_, id, &Offer::id);
  if (offer == offers_.end()) return false;
  record_sent(*offer, from);
  return true;
}

std::optional<Timestamp> MeshRelay::next_due() const {
  std::optional<Timestamp> next;
  for (const Offer& offer : offers_)
    if (!offer.bytes.empty()) next = std::min(next.value_or(offer.due), offer.due);
  return next;
}

std::vector<std::vector<std::uint8_t>> MeshRelay::take_due(Timestamp now) {
  std::vector<std::vector<std::uint8_t>> due;
  for (Offer& offer : offers_) {
    if (offer.bytes.empty() || offer.due > now) continue;
    std::vector<std::uint8_t> bytes = std::exchange(offer.bytes, {});
    if (missed_by(offer.sent_by, now) > 0 && neighbors_[offer.id.sender].forwards.try_consume(now))
      due.push_back(std::move(bytes));
  }
  return due;
}

}  // namespace crepes
