/// Links between robots with keys of their own, and what an insider can do against them: somebody
/// who has the swarm's key, as from a lost robot, but no other robot's own.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "net/mesh/peer_link.hpp"

namespace crepes::signed_link_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;

constexpr RobotId kOne{1};
constexpr RobotId kTwo{2};
constexpr RobotId kLost{3};
const std::vector<RobotId> kMembers{kOne, kTwo, kLost};
const std::optional<PacketSeal> kSeal(MeshKey{1, 2, 3});

RobotKey key_of(RobotId robot) {
  const std::array<std::uint8_t, 32> seed{static_cast<std::uint8_t>(robot.value)};
  return robot_key_of(seed);
}

std::optional<PacketSigner> signer_of(RobotId robot) { return PacketSigner(key_of(robot)); }

Endpoint address_of(RobotId robot) {
  return Endpoint::ipv4({10, 0, 0, static_cast<std::uint8_t>(robot.value)}, 47474);
}

MeshTrust trust_in(const std::vector<RobotId>& robots) {
  MeshTrust trust;
  for (const RobotId robot : robots) trust.keys.emplace(robot, public_key_of(key_of(robot)));
  return trust;
}

Report report_of(RobotId sender, Timestamp now) {
  Report report;
  report.sender = sender;
  report.stamp = now;
  report.tilt = {now, Eigen::Vector3d::UnitZ(), 0.01};
  for (int i = 0; i < 8; ++i)
    report.imu.push_back({now - milliseconds{10 * i}, {0.1, 0.2, 0.3}, {0, 0, 9.81}});
  return report;
}

/// Robots 1 and 2 exchange reports without loss; robot 1 is the one that is attacked. All clocks
/// are the same.
class SignedPair {
 public:
  SignedPair() {
    for (PeerLink* link : {&one, &two}) link->set_trust(trust_in(kMembers));
  }

  void run_until(double end_s) {
    for (; now_s < end_s; now_s += 0.001, ++step_) {
      if (attack) attack();
      if (step_ % 40 == 0) {
        last_of_two = two.compose(report_of(kTwo, now()), now(), seal,
                                  signs ? signer_of(kTwo) : std::nullopt);
        deliver(last_of_two, kTwo);
      }
      if (step_ % 40 == 20) {
        const auto bytes = one.compose(report_of(kOne, now()), now(), seal, signer_of(kOne));
        (void)two.receive(bytes, now() + milliseconds{3}, seal, address_of(kOne));
      }
    }
  }

  void deliver(const Bytes& bytes, RobotId from) {
    if (auto report = one.receive(bytes, now() + milliseconds{3}, seal, address_of(from)))
      received.push_back(*report);
  }

  [[nodiscard]] Timestamp now() const { return Timestamp{from_seconds(now_s)}; }
  [[nodiscard]] std::uint64_t count(MeshCounter counter) const { return one.counters()[counter]; }

  PeerLink one{kOne, kMembers};
  PeerLink two{kTwo, kMembers};
  std::optional<PacketSeal> seal = kSeal;
  bool signs = true;  ///< robot 2 does
  double now_s = 100.0;
  std::vector<ReceivedReport> received;  ///< by robot 1
  Bytes last_of_two;
  std::function<void()> attack;  ///< every millisecond

 private:
  int step_ = 0;
};

/// A datagram in robot 2's name with its session and next number, as the insider sees them.
OutgoingPeerMessage forged(const SignedPair& pair) {
  const PeerHeader seen = decode_peer_header(kSeal->open(pair.last_of_two).value()).value();
  OutgoingPeerMessage message;
  message.report = report_of(kTwo, pair.now());
  message.sent = pair.now();
  message.session = seen.session;
  message.sequence = seen.sequence + 1;
  return message;
}

TEST(SignedLink, HearsAPeerThatSigns) {
  SignedPair pair;
  pair.run_until(102.0);
  EXPECT_GT(pair.received.size(), 40U);

  pair.received.clear();
  pair.seal.reset();  // signatures do not need seals
  pair.run_until(104.0);
  EXPECT_GT(pair.received.size(), 45U);
}

TEST(SignedLink, RefusesAnInsiderInAnothersName) {
  SignedPair pair;
  pair.run_until(102.0);
  const auto refused_as = [&](MeshCounter reason, const Bytes& plain) {
    const std::uint64_t before = pair.count(reason);
    const std::size_t received = pair.received.size();
    pair.deliver(kSeal->seal(plain), kLost);
    EXPECT_EQ(pair.received.size(), received);
    return pair.count(reason) - before;
  };
  const Bytes plain = encode_peer_message(forged(pair)).bytes;

  EXPECT_EQ(refused_as(MeshCounter::kRefusedSignatureMissing, plain), 1U);
  EXPECT_EQ(refused_as(MeshCounter::kRefusedSignatureWrong, signer_of(kLost)->sign(plain)), 1U);
  Bytes copied = signer_of(kLost)->sign(plain);
  const Bytes genuine = kSeal->open(pair.last_of_two).value();
  std::copy(genuine.end() - 64, genuine.end(), copied.end() - 64);
  EXPECT_EQ(refused_as(MeshCounter::kRefusedSignatureWrong, copied), 1U);
  OutgoingPeerMessage restarted = forged(pair);
  restarted.session += 1;
  EXPECT_EQ(refused_as(MeshCounter::kRefusedSignatureWrong,
                       signer_of(kLost)->sign(encode_peer_message(restarted).bytes)),
            1U);

  // Robot 2's own next datagram has the number that the forged ones had.
  pair.received.clear();
  pair.run_until(103.0);
  EXPECT_GE(pair.received.size(), 24U);
  EXPECT_EQ(pair.count(MeshCounter::kRefusedDuplicate), 0U);
  EXPECT_EQ(pair.one.traffic(pair.now()).at(0).restarts, 0U);
}

TEST(SignedLink, RaisesNoAlarmAboutItsOwnIdForAnInsider) {
  SignedPair pair;
  pair.run_until(102.0);
  OutgoingPeerMessage message = forged(pair);
  message.report.sender = kOne;

  pair.deliver(kSeal->seal(signer_of(kLost)->sign(encode_peer_message(message).bytes)), kLost);
  pair.deliver(kSeal->seal(encode_peer_message(message).bytes), kLost);
  EXPECT_FALSE(pair.one.doubled_id());
  pair.deliver(kSeal->seal(signer_of(kOne)->sign(encode_peer_message(message).bytes)), kLost);
  EXPECT_TRUE(pair.one.doubled_id());  // a second robot with our files
}

TEST(SignedLink, RefusesWhatIsReplayed) {
  SignedPair pair;
  std::vector<Bytes> recorded;
  pair.attack = [&] {
    if (recorded.empty() || recorded.back() != pair.last_of_two)
      recorded.push_back(pair.last_of_two);
  };
  pair.run_until(102.0);
  pair.attack = nullptr;
  pair.received.clear();

  for (const Bytes& bytes : recorded) pair.deliver(bytes, kLost);
  EXPECT_TRUE(pair.received.empty());
  EXPECT_GE(pair.count(MeshCounter::kRefusedDuplicate), recorded.size() - 1);

  pair.two = PeerLink(kTwo, kMembers, {.session_salt = 5});
  pair.two.set_trust(trust_in(kMembers));
  pair.run_until(103.0);
  pair.received.clear();
  for (const Bytes& bytes : recorded) pair.deliver(bytes, kLost);
  EXPECT_TRUE(pair.received.empty());
  EXPECT_GE(pair.count(MeshCounter::kRefusedOldSession), recorded.size() - 1);
}

TEST(SignedLink, RefusesAnyBitError) {
  SignedPair pair;
  pair.run_until(101.0);
  pair.received.clear();
  const Bytes sealed =
      pair.two.compose(report_of(kTwo, pair.now()), pair.now(), kSeal, signer_of(kTwo));
  const Bytes opened = kSeal->open(sealed).value();

  for (std::size_t bit = 0; bit < 8 * sealed.size(); ++bit) {
    Bytes changed = sealed;
    changed[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    pair.deliver(changed, kLost);
  }
  // An insider can change what is inside of the seal. Each address has its own limit.
  for (std::size_t bit = 0; bit < 8 * opened.size(); ++bit) {
    Bytes changed = opened;
    changed[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    if (changed[0] != 'C' || changed[1] != 'R' || changed[2] != 'P') continue;
    pair.now_s += 0.01;
    pair.deliver(kSeal->seal(changed), kLost);
  }
  EXPECT_TRUE(pair.received.empty());
  EXPECT_GT(pair.count(MeshCounter::kRefusedSignatureWrong), 8 * (opened.size() - 18));
  EXPECT_EQ(pair.count(MeshCounter::kRefusedSignatureUnchecked), 0U);
}

TEST(SignedLink, BelievesAMemberWithoutKeyAsBefore) {
  SignedPair pair;
  pair.signs = false;
  pair.one.set_trust(trust_in({kOne, kLost}));
  pair.run_until(102.0);
  EXPECT_GT(pair.received.size(), 40U);

  pair.one.set_trust(trust_in(kMembers));
  pair.received.clear();
  pair.run_until(103.0);
  EXPECT_TRUE(pair.received.empty());
  EXPECT_EQ(pair.count(MeshCounter::kRefusedSignatureMissing), 25U);

  pair.signs = true;
  pair.run_until(104.0);
  EXPECT_GT(pair.received.size(), 20U);

  pair.received.clear();
  pair.one.set_trust({});  // a robot without the members' keys reads what is signed
  pair.run_until(105.0);
  EXPECT_GT(pair.received.size(), 20U);
}

TEST(SignedLink, ReadsNothingOfAnExcludedRobot) {
  SignedPair pair;
  pair.run_until(102.0);
  pair.received.clear();
  MeshTrust trust = trust_in({kOne, kLost});
  trust.excluded.insert(kTwo);
  pair.one.set_trust(trust);
  pair.one.set_members({kOne, kLost});

  pair.run_until(103.0);
  EXPECT_TRUE(pair.received.empty());
  EXPECT_EQ(pair.count(MeshCounter::kRefusedExcluded), 25U);
  EXPECT_TRUE(pair.one.clocks().empty());
  EXPECT_TRUE(pair.one.traffic(pair.now()).empty());

  pair.one.set_trust(trust_in(kMembers));  // found again
  pair.one.set_members(kMembers);
  pair.run_until(104.0);
  EXPECT_GT(pair.received.size(), 10U);
}

TEST(SignedLink, AccountsForSealAndSignatureInItsShareOfTheAir) {
  for (const std::size_t neighbors : {0U, 4U, 19U}) {
    std::vector<RobotId> members{kOne};
    for (std::size_t i = 0; i < neighbors; ++i)
      members.emplace_back(static_cast<std::uint16_t>(2 + i));
    PeerLink link(kOne, members);
    link.set_trust(trust_in(members));
    for (std::size_t i = 1; i < members.size(); ++i) {
      PeerLink peer(members[i], members);
      const auto bytes = peer.compose(report_of(members[i], Timestamp{}), Timestamp{}, kSeal,
                                      signer_of(members[i]));
      (void)link.receive(bytes, Timestamp{} + milliseconds{3}, kSeal, address_of(members[i]));
    }
    Report report = report_of(kOne, Timestamp{} + milliseconds{10});
    for (int i = 0; i < 60 * static_cast<int>(neighbors); ++i) {
      const RobotId neighbor = members[1 + static_cast<std::size_t>(i) % neighbors];
      report.ranges.push_back({report.stamp - milliseconds{i}, neighbor, 3.0, -80.0, -79.0});
    }
    const std::size_t size = link.compose(report, report.stamp, kSeal, signer_of(kOne)).size();

    // The least that a datagram may be limited to, with seal and signature, is above the share.
    const std::size_t least = kMinPeerMessage + PacketSeal::kOverhead + PacketSigner::kOverhead;
    EXPECT_LE(size, std::max(pace_of({}, neighbors).bytes, least)) << neighbors;
    EXPECT_LE(25 * size / pace_of({}, neighbors).reports, neighbors == 19 ? 12'000U : 10'000U)
        << neighbors;
  }
}

TEST(SignedLink, HearsARobotInWhoseNameAndAddressAnInsiderFillsTheChannel) {
  SignedPair pair;
  pair.run_until(101.0);
  std::uint32_t ahead = 0;
  pair.attack = [&] {
    OutgoingPeerMessage message = forged(pair);
    message.sequence += ahead++ % 60;
    pair.deliver(kSeal->seal(signer_of(kLost)->sign(encode_peer_message(message).bytes)), kTwo);
  };
  pair.received.clear();
  pair.run_until(106.0);  // 1000 a second, 70 % of a channel of 6 Mbit/s

  EXPECT_GE(pair.received.size(), 124U);
  EXPECT_GE(pair.count(MeshCounter::kRefusedSignatureWrong), 4900U);
  EXPECT_EQ(pair.count(MeshCounter::kRefusedSignatureUnchecked), 0U);
}

/// Reports with 100 forged datagrams a millisecond.
SignedPair flooded(const std::function<Bytes(const SignedPair&)>& forge) {
  SignedPair pair;
  pair.run_until(101.0);  // the peers know each other
  pair.attack = [&] {
    const Bytes bytes = forge(pair);
    for (int i = 0; i < 100; ++i) pair.deliver(bytes, kLost);
  };
  pair.run_until(103.0);
  pair.attack = nullptr;
  return pair;
}

TEST(SignedLink, IsNotMovedByAHundredThousandForgedDatagramsASecond) {
  const SignedPair calm = flooded([](const SignedPair&) { return Bytes{}; });
  const PacketSeal stranger(MeshKey{3, 2, 1});
  std::uint32_t ahead = 0;
  const SignedPair by_stranger = flooded([&](const SignedPair& pair) {
    return stranger.seal(signer_of(kLost)->sign(encode_peer_message(forged(pair)).bytes));
  });
  const SignedPair by_insider = flooded([&](const SignedPair& pair) {
    OutgoingPeerMessage message = forged(pair);
    message.sequence += ahead++ % 60;
    return kSeal->seal(signer_of(kLost)->sign(encode_peer_message(message).bytes));
  });

  EXPECT_EQ(by_stranger.count(MeshCounter::kRefusedSealBroken), 200'000U);
  EXPECT_EQ(by_insider.count(MeshCounter::kRefusedSignatureWrong) +
                by_insider.count(MeshCounter::kRefusedSignatureUnchecked),
            200'000U);
  EXPECT_LT(by_insider.count(MeshCounter::kRefusedSignatureWrong), 1'300U);  // verified
  for (const SignedPair* pair : {&by_stranger, &by_insider}) {
    ASSERT_EQ(pair->received.size(), calm.received.size());
    for (std::size_t i = 0; i < calm.received.size(); ++i) {
      EXPECT_EQ(pair->received[i].report.stamp, calm.received[i].report.stamp);
      EXPECT_EQ(pair->received[i].report.imu.size(), calm.received[i].report.imu.size());
      EXPECT_EQ(pair->received[i].clock_sigma_s, calm.received[i].clock_sigma_s);
    }
    EXPECT_EQ(pair->one.traffic(pair->now()).at(0).lost, 0U);
  }
}

}  // namespace
}  // namespace crepes::signed_link_test
