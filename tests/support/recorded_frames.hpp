/// Frames that real devices sent.
#pragma once

#include "tests/support/hex.hpp"

namespace crepes {

/// LinkTrack tag 1, four anchors 0 to 3: 3.179, 5.548, 6.728, 4.651 m, measured 20 ms earlier.
inline std::vector<std::uint8_t> recorded_node_frame2() {
  return bytes_of(
      "55 04 ac 00 02 01 ba 66 1d 00 06 09 ff de 0a 00 df ff ff e8 03 00 fa ff ff 1a 00 00 00 00 "
      "00 c0 12 00 00 00 00 00 00 00 27 ac e2 3c 56 ed 1c 3c d2 70 3b bd 32 57 66 3e 3b cb 1b 41 "
      "93 70 61 bd 25 b2 6b 41 a1 22 6c 41 da da 6b 41 6d 23 e9 23 70 dd db f7 30 3f 5f d6 31 3f "
      "ba 81 1e 3e 47 69 e2 bd 91 9b 40 40 c5 23 00 00 40 40 5c d5 1c 00 00 00 1d 00 6d 13 04 01 "
      "00 6b 0c 00 b1 9f a6 66 1d 00 16 45 01 01 ac 15 00 b4 a1 a6 66 1d 00 d3 01 01 02 48 1a 00 "
      "ca 9f a6 66 1d 00 38 ba 01 03 2b 12 00 c6 a0 a6 66 1d 00 64 40 25");
}

/// LinkTrack tag 1, four anchors 0 to 3: 2.85, 6.051, 7.304, 5.35 m.
inline std::vector<std::uint8_t> recorded_node_frame3() {
  return bytes_of(
      "55 05 32 00 02 01 f8 11 07 00 6f d0 6e 00 00 00 01 02 5a 13 04 01 00 22 0b 00 b5 9f 01 01 "
      "a3 17 00 b6 a0 01 02 88 1c 00 aa 9f 01 03 e6 14 00 b8 a0 9a");
}

/// WitMotion HWT905: frames 51 52 53 54 51 52 53, at rest and level.
inline std::vector<std::uint8_t> recorded_witmotion() {
  return bytes_of(
      "55 51 01 00 fe ff 00 08 7a 0b 31 55 52 00 00 00 00 00 00 7a 0b 2c 55 53 f4 ff f5 ff d3 c0 "
      "24 29 6f 55 54 86 f4 37 00 92 f8 7a 0b 69 55 51 00 00 f9 ff 00 08 7f 0b 30 55 52 00 00 01 "
      "00 ff ff 7f 0b 30 55 53 f4 ff f6 ff d1 c0 24 29 6e");
}

}  // namespace crepes
