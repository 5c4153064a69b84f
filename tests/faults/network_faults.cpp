#include "tests/faults/network_faults.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "net/mesh/crc32.hpp"

namespace crepes::faults {
namespace {

constexpr std::size_t kRecorded = 200;  // datagrams of a sender that an adversary keeps

bool concerns(const Fault& fault, RobotId from, RobotId to) {
  return from == fault.robot || to == fault.robot;
}

/// As a second daemon with the robot's id would send it.
void change_session(std::vector<std::uint8_t>& bytes) {
  constexpr std::size_t kSession = 6;  // after mark, version and sender
  constexpr std::size_t kChecksum = 4;
  if (bytes.size() < kSession + kChecksum) return;
  bytes[kSession] ^= 0x55U;
  const std::size_t body = bytes.size() - kChecksum;
  const std::uint32_t crc = crc32(std::span(bytes).first(body));
  for (std::size_t i = 0; i < kChecksum; ++i)
    bytes[body + i] = static_cast<std::uint8_t>(crc >> (8 * i));
}

/// Of every two seconds the first 0.8 s.
bool is_burst(const Fault& fault, double t_s) { return std::fmod(t_s - fault.from_s, 2.0) < 0.8; }

}  // namespace

void FaultyNetwork::operator()(RobotId from, RobotId to, double sent_s,
                               std::vector<Delivery>& deliveries) {
  std::vector<Delivery>& recorded = recorded_[from];
  if (!deliveries.empty() && recorded.size() < kRecorded) recorded.push_back(deliveries.front());
  for (const Fault& fault : faults_)
    if (fault.lasts_at(sent_s)) apply(fault, from, to, sent_s, deliveries);
}

void FaultyNetwork::apply(const Fault& fault, RobotId from, RobotId to, double sent_s,
                          std::vector<Delivery>& deliveries) {
  const auto drop = [&](double probability) {
    std::erase_if(deliveries, [&](const Delivery&) { return dice_.happens(probability); });
  };
  const auto delay = [&](double low, double high) {
    for (Delivery& delivery : deliveries) delivery.arrives_s += dice_.between(low, high);
  };
  switch (fault.kind) {
    case Kind::kLoss:
      return drop(0.6);
    case Kind::kBurstLoss:
      return drop(is_burst(fault, sent_s) ? 1.0 : 0.0);
    case Kind::kDelay:
      return from == fault.robot ? delay(0.15, 0.15) : void();
    case Kind::kJitter:
      return delay(0.0, 0.2);
    case Kind::kDuplication:
      for (std::size_t i = 0, n = deliveries.size(); i < n; ++i)
        deliveries.push_back({deliveries[i].arrives_s + 0.05, deliveries[i].bytes});
      return;
    case Kind::kPartition:
      return drop((from <= fault.robot) != (to <= fault.robot) ? 1.0 : 0.0);
    case Kind::kOneWay:
      return drop(from == fault.robot ? 1.0 : 0.0);
    case Kind::kDamage:
      for (Delivery& delivery : deliveries)
        if (dice_.happens(0.3)) damage(delivery.bytes);
      return;
    case Kind::kTruncation:
      for (Delivery& delivery : deliveries)
        if (concerns(fault, from, to))
          delivery.bytes.resize(std::min<std::size_t>(delivery.bytes.size(), 500));
      return;
    case Kind::kReplay:
      if (from != fault.robot || recorded_[from].empty()) return;
      for (int i = 0; i < 3; ++i) {
        const std::vector<Delivery>& all = recorded_[from];
        deliveries.push_back({sent_s + 0.01, all[dice_.below(all.size())].bytes});
      }
      return;
    case Kind::kDoubledId:
      if (from != fault.robot || deliveries.empty()) return;
      deliveries.push_back(deliveries.front());
      return change_session(deliveries.back().bytes);
    default:
      return;
  }
}

void FaultyNetwork::damage(std::vector<std::uint8_t>& bytes) {
  for (int i = 0; i < 4 && !bytes.empty(); ++i)
    bytes[dice_.below(bytes.size())] ^= static_cast<std::uint8_t>(1U << dice_.below(8));
}

void corrupt_report(const std::vector<Fault>& faults, double true_s, Report& report) {
  for (const Fault& fault : faults) {
    if (!fault.lasts_at(true_s) || fault.robot != report.sender) continue;
    if (fault.kind == Kind::kLiarEstimates) {
      for (NeighborEstimate& estimate : report.estimates) {
        estimate.T_B_N.pose.p(estimate.neighbor.value % 3) += 2.0;
        estimate.T_B_N.covariance = 1e-6 * Matrix6d::Identity();
      }
    } else if (fault.kind == Kind::kLiarTilt) {
      report.tilt.up_B = -report.tilt.up_B;
      report.tilt.sigma_rad = 1e-4;
    } else if (fault.kind == Kind::kLiarRanges) {
      for (UwbRange& range : report.ranges) range.range_m *= 1.5;
    }
  }
}

std::vector<Outage> outages_of(const std::vector<Fault>& faults) {
  std::vector<Outage> outages;
  for (const Fault& fault : faults) {
    if (fault.kind == Kind::kReboot || fault.kind == Kind::kFreeze)
      outages.push_back({.robot = fault.robot,
                         .from_s = fault.from_s,
                         .to_s = fault.to_s,
                         .restarts = fault.kind == Kind::kReboot});
  }
  return outages;
}

}  // namespace crepes::faults
