#include "drivers/serial/frame_decoder.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "drivers/imu/witmotion.hpp"
#include "drivers/uwb/nlink.hpp"
#include "tests/support/frame_damage.hpp"
#include "tests/support/recorded_frames.hpp"

namespace crepes::frame_decoder_test {
namespace {

TEST(FrameDecoder, FindsTheSameFramesInEveryChunkSize) {
  const auto uwb = recorded_node_frame2() + recorded_node_frame3();
  const auto imu = recorded_witmotion();
  for (std::size_t chunk = 1; chunk <= uwb.size(); ++chunk) {
    EXPECT_EQ(decode<NlinkParser>(uwb, chunk),
              (Frames{recorded_node_frame2(), recorded_node_frame3()}));
    EXPECT_EQ(decode<WitMotionParser>(imu, chunk).size(), 5U);  // two are pairs
  }
}

TEST(FrameDecoder, CountsWhatItSkipsAndWhatFailed) {
  auto bad = recorded_node_frame3();
  bad.back() ^= 1U;
  FrameDecoder<NlinkParser> decoder;

  decode(decoder, bytes_of("00 01 02") + bad + recorded_node_frame3(), 7);

  EXPECT_EQ(decoder.counts().frames, 1U);
  EXPECT_EQ(decoder.counts().checksum_failures, 1U);
  EXPECT_EQ(decoder.counts().skipped_bytes, 3U + bad.size());
  EXPECT_EQ(decoder.counts().skipped_in_a_row, 0U);
}

TEST(FrameDecoder, ResumesOneBytePastAFalseStart) {
  // The last byte of the garbage and the first of the frame look like a start together.
  const auto stream = bytes_of("55 05 55 55") + recorded_node_frame3();

  EXPECT_EQ(decode<NlinkParser>(stream), Frames{recorded_node_frame3()});
}

TEST(FrameDecoder, AccountsForEveryByteOfAnyStream) {
  EXPECT_TRUE(rc::check([](const std::vector<std::uint8_t>& garbage, bool with_header) {
    auto stream = garbage;
    if (with_header) stream = bytes_of("55 05 ff ff") + stream;
    const auto chunk = *rc::gen::inRange<std::size_t>(1, 40);
    FrameDecoder<NlinkParser> decoder;
    const Frames frames = decode(decoder, stream, chunk);

    std::size_t in_frames = 0;
    for (const auto& frame : frames) in_frames += frame.size();
    const std::size_t reported = in_frames + decoder.counts().skipped_bytes;
    RC_ASSERT(reported <= stream.size());
    RC_ASSERT(stream.size() - reported < NlinkParser::kMaxFrame);

    // Whatever came before: after enough frames one comes through again.
    Frames after;
    for (int i = 0; i < 100; ++i) {
      for (auto& frame : decode(decoder, recorded_node_frame3(), chunk)) after.push_back(frame);
    }
    RC_ASSERT(after.size() >= 30U);
    RC_ASSERT(after.back() == recorded_node_frame3());
  }));
}

}  // namespace
}  // namespace crepes::frame_decoder_test
