#include "tests/faults/network_faults.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "net/mesh/crc32.hpp"

namespace crepes::faults {
namespace {

using Bytes = FaultyNetwork::Bytes;

constexpr std::size_t kRecorded = 200;  // datagrams of a sender that an adversary keeps
constexpr double kFlood = 20.0;         // datagrams for each true one
constexpr double kReplays = 10.0;

bool concerns(const Fault& fault, RobotId from, RobotId to) {
  return from == fault.robot || to == fault.robot;
}

/// As a second daemon with the robot's id would send it.
void change_session(Bytes& bytes) {
  constexpr std::size_t kSession = 6;  // after mark, version and sender
  constexpr std::size_t kChecksum = 4;
  if (bytes.size() < kSession + kChecksum) return;
  bytes[kSession] ^= 0x55U;
  const std::size_t body = bytes.size() - kChecksum;
  const std::uint32_t crc = crc32(std::span(bytes).first(body));
  for (std::size_t i = 0; i < kChecksum; ++i)
    bytes[body + i] = static_cast<std::uint8_t>(crc >> (8 * i));
}

bool is_burst(const Fault& fault, double t_s) {
  constexpr double kPeriod_s = 2.0;
  return std::fmod(t_s - fault.from_s, kPeriod_s) < 0.4 * fault.rate * kPeriod_s;
}

/// A number that nobody expects.
double extreme(Dice& dice) {
  constexpr std::array kValues{0.0,    -1.0,  1e9,
                               -1e9,   1e300, std::numeric_limits<double>::infinity(),
                               1e-300, 199.0, std::numeric_limits<double>::quiet_NaN()};
  return kValues.at(dice.below(kValues.size()));
}

template <class Items, class Change>
void change_each(Items& items, const Change& change) {
  for (auto& item : items) change(item);
}

/// What a liar says instead of the truth: anything at all, or what the encoder lets pass.
struct Lies {
  Dice& dice;
  bool are_bounded = false;

  double number(double low, double high) {
    if (!are_bounded) return extreme(dice);
    if (dice.happens(0.5)) return dice.between(low, high);
    return dice.happens(0.5) ? low : high;
  }
  Eigen::Vector3d direction() {
    const Eigen::Vector3d any(number(-1, 1), dice.between(-1, 1), dice.between(0.1, 1));
    return are_bounded ? any.normalized() : any;
  }
  RobotId robot() {
    return RobotId{static_cast<std::uint16_t>(are_bounded ? 1 + dice.below(5) : dice.below(65536))};
  }
  Duration shift() {
    return from_seconds(are_bounded ? dice.between(-0.5, 0.05) : dice.between(-20.0, 20.0));
  }
};

/// One kind of a report's fields becomes a lie. Every field is such a kind.
void replace_field(Report& report, Lies lies) {
  switch (lies.dice.below(18)) {
    case 0:
      return change_each(report.imu, [&](auto& s) { s.gyro_radps(0) = lies.number(-34, 34); });
    case 1:
      return change_each(report.imu, [&](auto& s) { s.accel_mps2(2) = lies.number(-150, 150); });
    case 2:
      return change_each(report.imu, [&](auto& s) { s.stamp += lies.shift(); });
    case 3:
      return change_each(report.ranges, [&](auto& r) { r.range_m = lies.number(0.01, 200); });
    case 4:
      return change_each(report.ranges, [&](auto& r) { r.stamp += lies.shift(); });
    case 5:
      return change_each(report.ranges, [&](auto& r) { r.neighbor = lies.robot(); });
    case 6:
      return change_each(report.ranges, [&](auto& r) {
        r.first_path_dbm = lies.number(-127, 0);
        r.received_dbm = lies.number(-127, 0);
      });
    case 7:
      return change_each(report.bearings, [&](auto& b) { b.sigma_rad = lies.number(1e-5, 1); });
    case 8:
      return change_each(report.bearings, [&](auto& b) { b.p_B_C(1) = lies.number(-100, 100); });
    case 9:
      return change_each(report.bearings, [&](auto& b) { b.u_B = lies.direction(); });
    case 10:
      return change_each(report.bearings, [&](auto& b) { b.neighbor = lies.robot(); });
    case 11:
      return change_each(report.bearings, [&](auto& b) { b.stamp += lies.shift(); });
    case 12:
      return change_each(report.estimates, [&](auto& e) {
        e.T_B_N.pose.p(0) = lies.number(-1e3, 1e3);
        e.v_B_N(0) = lies.number(-1e3, 1e3);
      });
    case 13:
      return change_each(report.estimates,
                         [&](auto& e) { e.T_B_N.covariance *= lies.number(1e-6, 1e6); });
    case 14:
      return change_each(report.estimates, [&](auto& e) {
        e.T_B_N.pose.q = Eigen::AngleAxisd(lies.number(-3, 3), lies.direction().normalized());
      });
    case 15:
      return change_each(report.estimates, [&](auto& e) {
        e.stamp += lies.shift();
        e.neighbor = lies.robot();
      });
    case 16:
      report.tilt.up_B = lies.direction();
      return;
    default:
      report.tilt.sigma_rad = lies.number(1e-5, 3);
      report.tilt.stamp += lies.shift();
      return;
  }
}

void lie(const Fault& fault, Dice& dice, Report& report) {
  switch (fault.kind) {
    case Kind::kLiarEstimates:
      return change_each(report.estimates, [&](NeighborEstimate& e) {
        e.T_B_N.pose.p(e.neighbor.value % 3) += 2.0 * fault.rate;
        e.T_B_N.covariance = 1e-6 * Matrix6d::Identity();
      });
    case Kind::kLiarTilt:
      report.tilt.up_B = -report.tilt.up_B;
      report.tilt.sigma_rad = 1e-4;
      return;
    case Kind::kLiarRanges:
      return change_each(report.ranges, [&](auto& r) { r.range_m *= 1.0 + 0.5 * fault.rate; });
    case Kind::kLiarBearings: {
      const Eigen::AngleAxisd turn(0.3 * fault.rate, Eigen::Vector3d::UnitZ());
      return change_each(report.bearings, [&](auto& b) { b.u_B = turn * b.u_B; });
    }
    case Kind::kLiarImu:
      return change_each(report.imu, [&](auto& s) { s.gyro_radps *= 1.0 + fault.rate; });
    case Kind::kLiarExtremes:
      return replace_field(report, {dice, false});
    case Kind::kLiarWithinBounds:
      return replace_field(report, {dice, true});
    default:
      return;
  }
}

}  // namespace

void FaultyNetwork::strike(const std::vector<Fault>& faults) {
  faults_ = faults;
  if (!faults.empty()) dice_ = Dice(faults.front().seed);
}

void FaultyNetwork::operator()(RobotId from, RobotId to, double sent_s,
                               std::vector<Delivery>& deliveries) {
  if (!deliveries.empty()) record(deliveries.front(), from, sent_s);
  for (const Fault& fault : faults_)
    if (fault.lasts_at(sent_s)) apply(fault, from, to, sent_s, deliveries);
}

/// What an adversary on the air keeps. A robot that restarts for `kReplayedSession` leaves a
/// session that has ended.
void FaultyNetwork::record(const Delivery& delivery, RobotId from, double sent_s) {
  for (const Fault& fault : faults_)
    if (fault.kind == Kind::kReplayedSession && fault.robot == from && fault.lasts_at(sent_s) &&
        !ended_.contains(from))
      ended_[from] = std::exchange(recorded_[from], {});
  std::deque<Bytes>& recorded = recorded_[from];
  recorded.push_back(delivery.bytes);
  if (recorded.size() > kRecorded) recorded.pop_front();
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
      return drop(0.6 * fault.rate);
    case Kind::kBurstLoss:
      return drop(is_burst(fault, sent_s) ? 1.0 : 0.0);
    case Kind::kDelay:
      return from == fault.robot ? delay(0.25 * fault.rate, 0.25 * fault.rate) : void();
    case Kind::kJitter:
      return delay(0.0, 0.25 * fault.rate);
    case Kind::kDuplication:
      for (std::size_t i = 0, n = deliveries.size(); i < n; ++i)
        for (int copy = 1; copy <= 5 * fault.rate; ++copy)
          deliveries.push_back(
              {deliveries[i].arrives_s + 0.03 * copy, deliveries[i].bytes, deliveries[i].from});
      return;
    case Kind::kPartition:
      return drop((from <= fault.robot) != (to <= fault.robot) ? 1.0 : 0.0);
    case Kind::kOneWay:
      return drop(from == fault.robot ? 1.0 : 0.0);
    case Kind::kDamage:
      for (Delivery& delivery : deliveries)
        if (dice_.happens(0.6 * fault.rate)) damage(delivery.bytes);
      return;
    case Kind::kTruncation:
      for (Delivery& delivery : deliveries)
        if (concerns(fault, from, to))
          delivery.bytes.resize(std::min<std::size_t>(delivery.bytes.size(),
                                                      static_cast<std::size_t>(800 * fault.rate)));
      return;
    case Kind::kGarbageFlood:
    case Kind::kForgedFlood:
      return to == fault.robot ? flood(fault, sent_s, deliveries) : void();
    case Kind::kReplay:
    case Kind::kReplayedSession:
      return from == fault.robot ? replay(fault, from, sent_s, deliveries) : void();
    case Kind::kDoubledId:
      if (from != fault.robot || deliveries.empty()) return;
      deliveries.push_back({deliveries.front().arrives_s,
                            of_second_robot(deliveries.front().bytes, from),
                            replay_address(RobotId{99})});
      return;
    default:
      return;
  }
}

/// Noise, or copies of a true datagram with other contents in the name of its sender.
void FaultyNetwork::flood(const Fault& fault, double sent_s, std::vector<Delivery>& deliveries) {
  if (deliveries.empty()) return;
  const Delivery model = deliveries.front();
  for (int i = 0; i < kFlood * fault.rate; ++i) {
    Bytes bytes = model.bytes;
    if (fault.kind == Kind::kGarbageFlood) {
      bytes.resize(dice_.below(1500));
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(dice_.next());
    } else {
      constexpr std::size_t kHeader = 18;
      damage(bytes);
      std::copy_n(model.bytes.begin(), std::min(kHeader, bytes.size()), bytes.begin());
    }
    deliveries.push_back({sent_s + dice_.between(0.001, 0.03), std::move(bytes),
                          replay_address(RobotId{static_cast<std::uint16_t>(99 + i)})});
  }
}

void FaultyNetwork::replay(const Fault& fault, RobotId from, double sent_s,
                           std::vector<Delivery>& deliveries) {
  const std::deque<Bytes>& all =
      fault.kind == Kind::kReplayedSession ? ended_[from] : recorded_[from];
  for (int i = 0; i < kReplays * fault.rate && !all.empty(); ++i)
    deliveries.push_back(
        {sent_s + 0.01, all[dice_.below(all.size())], replay_address(RobotId{98})});
}

void FaultyNetwork::damage(Bytes& bytes) {
  for (int i = 0; i < 4 && !bytes.empty(); ++i)
    bytes[dice_.below(bytes.size())] ^= static_cast<std::uint8_t>(1U << dice_.below(8));
}

/// With all of the robot's keys: a copy of its memory card.
Bytes FaultyNetwork::of_second_robot(const Bytes& bytes, RobotId from) const {
  if (!seal_) {
    Bytes plain = bytes;
    change_session(plain);
    return plain;
  }
  const auto opened = seal_->open(bytes);
  if (!opened) return bytes;
  Bytes plain = without_signature(*opened);
  change_session(plain);
  return seal_->seal(PacketSigner(replay_robot_key(from)).sign(plain));
}

Liars::Liars(const std::vector<Fault>& faults) {
  for (const Fault& fault : faults) liars_.push_back({fault, Dice(fault.seed)});
}

void Liars::operator()(double true_s, Report& report) {
  for (Liar& liar : liars_)
    if (liar.fault.lasts_at(true_s) && liar.fault.robot == report.sender)
      lie(liar.fault, liar.dice, report);
}

}  // namespace crepes::faults
