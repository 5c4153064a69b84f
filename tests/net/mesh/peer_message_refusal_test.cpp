/// Datagrams that no robot sends: cut, damaged, forged. The decoder refuses them.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>
#include <vector>

#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_code.hpp"
#include "tests/net/mesh/full_peer_message.hpp"

namespace crepes::peer_message_refusal_test {
namespace {

using test::full_message;

std::vector<std::uint8_t> resealed(std::vector<std::uint8_t> body) {
  const std::uint32_t sum = crc32(body);
  for (int i = 0; i < 4; ++i) body.push_back(static_cast<std::uint8_t>(sum >> (8 * i)));
  return body;
}

std::vector<std::uint8_t> body_of(const OutgoingPeerMessage& message) {
  auto bytes = encode_peer_message(message).bytes;
  bytes.resize(bytes.size() - 4);
  return bytes;
}

PeerMessageError fault_of(std::span<const std::uint8_t> bytes) {
  const auto message = decode_peer_message(bytes);
  EXPECT_FALSE(message.has_value());
  return message ? PeerMessageError{} : message.error();
}

bool is_finite(const PeerMessage& message) {
  const auto& report = message.report;
  const auto all = [](const auto& items, auto finite) {
    return std::all_of(items.begin(), items.end(), finite);
  };
  return report.tilt.up_B.allFinite() && std::isfinite(report.tilt.sigma_rad) &&
         all(report.imu,
             [](const auto& s) { return s.gyro_radps.allFinite() && s.accel_mps2.allFinite(); }) &&
         all(report.bearings,
             [](const auto& b) {
               return b.u_B.allFinite() && b.p_B_C.allFinite() && b.sigma_rad > 0 &&
                      b.neighbor.value > 0;
             }) &&
         all(report.ranges, [](const auto& r) { return std::isfinite(r.range_m); }) &&
         all(report.estimates, [](const auto& e) {
           return e.T_B_N.pose.p.allFinite() && e.T_B_N.pose.q.coeffs().allFinite() &&
                  e.T_B_N.covariance.allFinite() && e.v_B_N.allFinite();
         });
}

TEST(PeerMessage, RefusesEveryTruncation) {
  const auto bytes = encode_peer_message(full_message(3)).bytes;

  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_peer_message(std::span(bytes).first(size)).has_value()) << size;
}

TEST(PeerMessage, RefusesEveryDamagedByte) {
  const auto bytes = encode_peer_message(full_message(3)).bytes;

  for (std::size_t i = 0; i < bytes.size(); ++i)
    for (const int flip : {0x01, 0x80, 0xFF}) {
      auto damaged = bytes;
      damaged[i] ^= static_cast<std::uint8_t>(flip);
      EXPECT_FALSE(decode_peer_message(damaged).has_value()) << i;
    }
}

TEST(PeerMessage, DecodesToFiniteValuesOrNotAtAllWhateverASenderSeals) {
  const auto body = body_of(full_message(3));

  for (std::size_t i = 0; i < body.size(); ++i)
    for (const int value : {0x00, 0x01, 0x7F, 0x80, 0xFF}) {
      auto odd = body;
      odd[i] = static_cast<std::uint8_t>(value);
      const auto message = decode_peer_message(resealed(odd));
      EXPECT_TRUE(!message || is_finite(*message)) << i;
    }
  for (std::size_t size = 4; size < body.size(); ++size)
    EXPECT_FALSE(decode_peer_message(resealed({body.begin(), body.begin() + long(size)})));
}

TEST(PeerMessage, SurvivesRandomBytesBehindAValidSeal) {
  EXPECT_TRUE(rc::check([] {
    auto body = *rc::gen::container<std::vector<std::uint8_t>>(rc::gen::arbitrary<std::uint8_t>());
    const std::vector<std::uint8_t> preamble{'C', 'R', 'P', 2, 2, 0};
    body.insert(body.begin(), preamble.begin(), preamble.end());
    const auto message = decode_peer_message(resealed(body));
    const bool is_sound = !message || is_finite(*message);  // RC_ASSERT's own || evaluates both
    RC_ASSERT(is_sound);
  }));
}

TEST(PeerMessage, ReturnsTheFirstError) {
  const auto body = body_of(full_message(1));
  const auto with = [&](std::size_t at, std::initializer_list<int> values) {
    auto odd = body;
    for (const int value : values) odd[at++] = static_cast<std::uint8_t>(value);
    return fault_of(resealed(odd));
  };
  auto longer = body;
  longer.push_back(0);

  EXPECT_EQ(fault_of({}), PeerMessageError::kTooShort);
  EXPECT_EQ(fault_of(std::vector<std::uint8_t>(1401)), PeerMessageError::kTooLong);
  EXPECT_EQ(fault_of(std::vector<std::uint8_t>(100)), PeerMessageError::kForeign);
  EXPECT_EQ(with(3, {1}), PeerMessageError::kOtherVersion);
  EXPECT_EQ(fault_of(body), PeerMessageError::kDamaged);
  EXPECT_EQ(fault_of(resealed({body.begin(), body.end() - 1})), PeerMessageError::kTruncated);
  EXPECT_EQ(fault_of(resealed(longer)), PeerMessageError::kTrailingBytes);
  EXPECT_EQ(with(4, {0, 0}), PeerMessageError::kBadId);
  EXPECT_EQ(with(25, {0x7F}), PeerMessageError::kBadStamp);
}

/// The fault of a datagram whose checksum is right.
PeerMessageError fault_of_code(wire::CodedBody body) {
  std::vector<std::uint8_t> bytes{'C', 'R', 'P', 2, 1, 0};
  bytes.resize(kClearHeader);
  wire::BodyWriter writer;
  wire::code_body(writer, body);
  const auto code = std::move(writer).finished();
  bytes.insert(bytes.end(), code.begin(), code.end());
  return fault_of(resealed(bytes));
}

TEST(PeerMessage, RefusesWhatNoEncoderWrites) {
  wire::CodedBody seen;
  seen.cameras = {{0, 0, 0}};
  seen.sources.push_back({2, {{.age = 0}}, {{.age = 0, .range_mm = 1000}}});
  const auto with = [&](auto change) {
    wire::CodedBody body = seen;
    change(body.sources.front());
    return fault_of_code(body);
  };
  wire::CodedEstimate estimate{.neighbor = 2};
  const auto with_estimate = [](const wire::CodedEstimate& code) {
    wire::CodedBody body;
    body.estimates.push_back(code);
    return fault_of_code(body);
  };

  EXPECT_EQ(with([](auto& s) { s.bearings[0].u = {16384, 0}; }), PeerMessageError::kNotUnit);
  EXPECT_EQ(with([](auto& s) {
              s.bearings.push_back({.u = {1 << 20, 0}});
            }),
            PeerMessageError::kNotUnit);
  EXPECT_EQ(with([](auto& s) { s.bearings.push_back({.sigma = 128}); }),
            PeerMessageError::kOutOfRange);
  EXPECT_EQ(with([](auto& s) { s.bearings[0].age = 200'000; }), PeerMessageError::kBadStamp);
  EXPECT_EQ(with([](auto& s) { s.bearings[0].age = -20'000; }), PeerMessageError::kBadStamp);
  EXPECT_EQ(with([](auto& s) { s.ranges[0].range_mm = 0; }), PeerMessageError::kOutOfRange);
  EXPECT_EQ(with([](auto& s) { s.ranges[0].received = 256; }), PeerMessageError::kOutOfRange);
  EXPECT_EQ(with([](auto& s) { s.neighbor = 65535; }), PeerMessageError::kBadId);
  seen.cameras.clear();
  EXPECT_EQ(with([](auto&) {}), PeerMessageError::kBadIndex);

  wire::CodedBody moved;
  moved.imu = {.gyro_exponent = 30, .accel_exponent = 0, .predictions = {}, .samples = {{}}};
  EXPECT_EQ(fault_of_code(moved), PeerMessageError::kOutOfRange);
  moved.imu.gyro_exponent = 0;
  moved.imu.samples[0].values[0] = 1 << 30;
  EXPECT_EQ(fault_of_code(moved), PeerMessageError::kOutOfRange);

  estimate.q = {16383, 16383, 16383};
  EXPECT_EQ(with_estimate(estimate), PeerMessageError::kNotUnit);
  estimate.q = {};
  estimate.factor.fill(2047);
  EXPECT_EQ(with_estimate(estimate), PeerMessageError::kBadCovariance);
}

}  // namespace
}  // namespace crepes::peer_message_refusal_test
