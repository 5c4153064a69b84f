#include "net/mesh/packet_signature.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "net/mesh/packet_seal.hpp"
#include "net/mesh/peer_message.hpp"

namespace crepes::packet_signature_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

RobotKey key_of(std::uint8_t first) {
  std::array<std::uint8_t, 32> seed{first};
  return robot_key_of(seed);
}

Bytes datagram(const Bytes& body) {
  Bytes bytes{'C', 'R', 'P', 2, 1, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0};
  bytes.insert(bytes.end(), body.begin(), body.end());
  return bytes;
}

RC_GTEST_PROP(PacketSignature, IsOfItsSenderAndComesOff, (const Bytes& body)) {
  const RobotKey key = key_of(1);
  const Bytes plain = datagram(body);

  const Bytes bytes = PacketSigner(key).sign(plain);

  RC_ASSERT(bytes.size() == plain.size() + PacketSigner::kOverhead);
  RC_ASSERT(is_signed(bytes));
  RC_ASSERT(is_authentic(bytes, public_key_of(key)));
  RC_ASSERT(!is_authentic(bytes, public_key_of(key_of(2))));
  RC_ASSERT(without_signature(bytes) == plain);
}

TEST(PacketSignature, IsWrongAfterAnyBitError) {
  const RobotKey key = key_of(1);
  const Bytes whole = PacketSigner(key).sign(datagram(Bytes(40, 7)));

  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes changed = whole;
    changed[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_FALSE(is_authentic(changed, public_key_of(key))) << "bit " << bit;
  }
}

TEST(PacketSignature, IsWrongAfterAnyTruncation) {
  const RobotKey key = key_of(1);
  const Bytes whole = PacketSigner(key).sign(datagram(Bytes(40, 7)));

  for (std::size_t size = 0; size < whole.size(); ++size)
    EXPECT_FALSE(is_authentic(std::span(whole).first(size), public_key_of(key))) << size;
}

TEST(PacketSignature, TravelsInsideASeal) {
  const PacketSeal seal(MeshKey{1, 2, 3});
  const Bytes bytes = PacketSigner(key_of(1)).sign(datagram(Bytes(40, 7)));

  const Bytes sealed = seal.seal(bytes);

  EXPECT_TRUE(PacketSeal::is_sealed(sealed));
  EXPECT_EQ(seal.open(sealed).value(), bytes);
}

TEST(PacketSignature, HeadersOfSignedDatagramsAreRead) {
  const auto header = decode_peer_header(PacketSigner(key_of(1)).sign(datagram(Bytes(40, 7))));

  ASSERT_TRUE(header);
  EXPECT_EQ(header->sender, RobotId{1});
  EXPECT_EQ(header->session, 0x0807060504030201U);
  EXPECT_EQ(header->sequence, 9U);
}

// RFC 8032, section 7.1, test 1.
TEST(RobotKeys, AreThoseOfTheStandard) {
  const std::array<std::uint8_t, 32> seed{0x9d, 0x61, 0xb1, 0x9d, 0xef, 0xfd, 0x5a, 0x60,
                                          0xba, 0x84, 0x4a, 0xf4, 0x92, 0xec, 0x2c, 0xc4,
                                          0x44, 0x49, 0xc5, 0x69, 0x7b, 0x32, 0x69, 0x19,
                                          0x70, 0x3b, 0xac, 0x03, 0x1c, 0xae, 0x7f, 0x60};

  const PublicKey known = public_key_of(robot_key_of(seed));

  EXPECT_EQ(known.bytes[0], 0xd7);
  EXPECT_EQ(known.bytes[31], 0x1a);
  EXPECT_EQ(to_text(known), "11qYAYKxCrfVS/7TyWQHOg7hcvPapiMlrwIaaPcHURo=");
}

TEST(RobotKeys, AreWholeOnlyWithTheirOwnPublicPart) {
  RobotKey key = key_of(1);
  EXPECT_TRUE(is_whole(key));
  key.bytes[40] ^= 1U;
  EXPECT_FALSE(is_whole(key));
  EXPECT_FALSE(is_whole(RobotKey{}));
}

TEST(RobotKeys, AreReadAsTheyAreWritten) {
  const PublicKey known = public_key_of(key_of(3));
  const std::string text = to_text(known);

  EXPECT_EQ(text.size(), 44U);
  EXPECT_EQ(parse_public_key(text), known);
}

TEST(RobotKeys, AreRefusedAsWhatNoRobotHas) {
  const std::string good = to_text(public_key_of(key_of(3)));
  // The last are the neutral point and a point of order four: they make many signatures valid.
  for (const std::string& text :
       {std::string(), std::string("r2"), good.substr(1), good + "=", good + " ", "A" + good,
        "AQAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=" + std::string(),
        "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA=" + std::string()})
    EXPECT_FALSE(parse_public_key(text)) << text;
}

}  // namespace
}  // namespace crepes::packet_signature_test
