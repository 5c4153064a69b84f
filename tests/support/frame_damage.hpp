/// What a decoder must survive: frames cut short, cut into pieces, and with a bit turned over.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "drivers/serial/frame_decoder.hpp"
#include "tests/support/hex.hpp"

namespace crepes {

using Frames = std::vector<std::vector<std::uint8_t>>;

/// All frames of a stream that comes in pieces of `chunk` bytes.
template <class Protocol>
Frames decode(FrameDecoder<Protocol>& decoder, Bytes stream, std::size_t chunk = 4096) {
  Frames frames;
  for (std::size_t at = 0; at < stream.size(); at += chunk) {
    decoder.feed(stream.subspan(at, std::min(chunk, stream.size() - at)),
                 [&](Bytes frame) { frames.emplace_back(frame.begin(), frame.end()); });
  }
  return frames;
}

template <class Protocol>
Frames decode(Bytes stream, std::size_t chunk = 4096) {
  FrameDecoder<Protocol> decoder;
  return decode(decoder, stream, chunk);
}

/// `damaged`, then good frames: all of these must come out and nothing else. A false length may
/// wait for the longest frame's bytes, so there are as many.
template <class Protocol>
void expect_only_good_frames(const std::vector<std::uint8_t>& damaged,
                             const std::vector<std::uint8_t>& good, std::size_t which) {
  const std::size_t count = Protocol::kMaxFrame / good.size() + 2;
  std::vector<std::uint8_t> stream = damaged;
  for (std::size_t i = 0; i < count; ++i) stream.insert(stream.end(), good.begin(), good.end());
  const Frames frames = decode<Protocol>(stream);
  EXPECT_EQ(frames.size(), count) << which;
  for (const auto& frame : frames) ASSERT_EQ(frame, good) << which;
}

template <class Protocol>
void expect_refuses_damage(const std::vector<std::uint8_t>& good) {
  ASSERT_EQ(decode<Protocol>(good), Frames{good});
  for (std::size_t length = 0; length < good.size(); ++length) {
    expect_only_good_frames<Protocol>(
        {good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)}, good, length);
  }
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
    expect_only_good_frames<Protocol>(bad, good, bit);
  }
  for (std::size_t chunk = 1; chunk <= good.size(); ++chunk)
    EXPECT_EQ(decode<Protocol>(good + good + good, chunk), (Frames{good, good, good})) << chunk;
}

}  // namespace crepes
