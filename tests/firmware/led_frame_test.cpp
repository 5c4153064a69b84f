#include "firmware/protocol/led_frame.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <vector>

namespace crepes::led_frame_test {
namespace {

using ByteVector = std::vector<std::uint8_t>;

led_frame frame_of(std::uint8_t type, const ByteVector& payload) {
  led_frame frame{};
  frame.type = type;
  frame.size = static_cast<std::uint8_t>(payload.size());
  std::copy(payload.begin(), payload.end(), frame.payload);
  return frame;
}

ByteVector wire_of(const led_frame& frame) {
  ByteVector bytes(LED_MAX_FRAME);
  bytes.resize(led_frame_write(&frame, bytes.data()));
  return bytes;
}

bool are_equal(const led_frame& a, const led_frame& b) {
  return a.type == b.type && a.size == b.size && std::memcmp(a.payload, b.payload, a.size) == 0;
}

/// Frames of all sizes; payloads full of what a frame begins with.
std::vector<led_frame> frames() {
  std::vector<led_frame> all{frame_of(1, {}), frame_of(0xC5, {0xC5, 0x9A}),
                             frame_of(2, {0xC5, 0x9A, 0x00, 0x01, 0xC5, 0x9A, 0x20})};
  std::mt19937 random(1);
  for (std::size_t size = 0; size <= LED_MAX_PAYLOAD; ++size) {
    ByteVector payload(size);
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random());
    all.push_back(frame_of(static_cast<std::uint8_t>(random()), payload));
  }
  return all;
}

/// All frames in `bytes`, with a silent line at the end.
std::vector<led_frame> received(const ByteVector& bytes, led_receiver& receiver) {
  std::vector<led_frame> out;
  led_frame frame{};
  for (const std::uint8_t byte : bytes) {
    led_receiver_push(&receiver, byte);
    while (led_receiver_next(&receiver, false, &frame)) out.push_back(frame);
  }
  while (led_receiver_next(&receiver, true, &frame)) out.push_back(frame);
  return out;
}

TEST(LedFrame, ChecksumIsThatOfCcitt) {
  const char* text = "123456789";

  EXPECT_EQ(led_crc16(reinterpret_cast<const std::uint8_t*>(text), 9), 0x29B1);
}

TEST(LedFrame, ComesOutAsItWasWritten) {
  for (const led_frame& frame : frames()) {
    led_receiver receiver{};
    const std::vector<led_frame> out = received(wire_of(frame), receiver);

    ASSERT_EQ(out.size(), 1U);
    EXPECT_TRUE(are_equal(out.front(), frame));
    EXPECT_EQ(receiver.skipped, 0);
  }
}

TEST(LedFrame, EveryTruncationIsRefusedAndTheNextFrameUnderstood) {
  const led_frame next = frame_of(4, {});
  for (const led_frame& frame : frames()) {
    const ByteVector whole = wire_of(frame);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      led_receiver receiver{};
      const ByteVector cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));

      EXPECT_TRUE(received(cut, receiver).empty());
      const std::vector<led_frame> out = received(wire_of(next), receiver);

      ASSERT_EQ(out.size(), 1U) << size;
      EXPECT_TRUE(are_equal(out.front(), next));
      EXPECT_EQ(receiver.skipped, size);
    }
  }
}

TEST(LedFrame, EveryBitErrorIsRefusedAndTheNextFrameUnderstoodWithoutAPause) {
  const led_frame next = frame_of(4, {7});
  for (const led_frame& frame : frames()) {
    const ByteVector whole = wire_of(frame);
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
      ByteVector bytes = whole;
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
      const ByteVector following = wire_of(next);
      bytes.insert(bytes.end(), following.begin(), following.end());

      led_receiver receiver{};
      const std::vector<led_frame> out = received(bytes, receiver);

      ASSERT_EQ(out.size(), 1U) << "bit " << bit << " of a payload of " << +frame.size;
      EXPECT_TRUE(are_equal(out.front(), next));
      EXPECT_EQ(receiver.skipped, whole.size());
    }
  }
}

TEST(LedFrame, NoiseYieldsNoFrameAndHidesNone) {
  std::mt19937 random(2);
  const led_frame frame = frame_of(1, {1, 2, 3});
  for (int trial = 0; trial < 2000; ++trial) {
    ByteVector bytes(random() % 60U);
    for (std::uint8_t& byte : bytes)
      byte = random() % 3U == 0 ? (random() % 2U == 0 ? 0xC5 : 0x9A)
                                : static_cast<std::uint8_t>(random());
    const ByteVector whole = wire_of(frame);
    bytes.insert(bytes.end(), whole.begin(), whole.end());

    led_receiver receiver{};
    const std::vector<led_frame> out = received(bytes, receiver);

    ASSERT_EQ(out.size(), 1U);
    EXPECT_TRUE(are_equal(out.front(), frame));
  }
}

TEST(LedFrame, AFalseStartThatSwallowsTwoFramesGivesBothBack) {
  const led_frame small = frame_of(1, {});
  ByteVector bytes{0xC5, 0x9A, 10, 0};
  for (int i = 0; i < 2; ++i) {
    const ByteVector whole = wire_of(small);
    bytes.insert(bytes.end(), whole.begin(), whole.end());
  }

  led_receiver receiver{};

  EXPECT_EQ(received(bytes, receiver).size(), 2U);
}

}  // namespace
}  // namespace crepes::led_frame_test
