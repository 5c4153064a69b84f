/// Finds frames in a byte stream. Accesses no device.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/core/contract.hpp"

namespace crepes {

using Bytes = std::span<const std::uint8_t>;

/// The kind of frame at the beginning of some bytes.
enum class FrameKind : std::uint8_t {
  kNone,         ///< no frame of this protocol
  kIncomplete,   ///< valid so far; needs more bytes
  kBadChecksum,  ///< a frame with a wrong checksum
  kForeign,      ///< a frame of this device in another mode of operation
  kUnchecked,    ///< a frame of `length` bytes of a kind whose checksum cannot be computed
  kComplete,     ///< a frame of `length` bytes
};

/// Whether bytes begin with a frame, and its length.
struct FrameCheck {
  FrameKind kind = FrameKind::kNone;
  std::size_t length = 0;
};

template <class Protocol>
concept FrameProtocol = requires(Bytes bytes) {
  /// Needs at least one byte. Never kIncomplete for kMaxFrame bytes or more.
  { Protocol::examine(bytes) } -> std::same_as<FrameCheck>;
  { Protocol::kMaxFrame } -> std::convertible_to<std::size_t>;
};

/// Totals since the start; `..._in_a_row` since the last valid frame.
struct DecoderCounts {
  std::uint64_t frames = 0;
  std::uint64_t unchecked = 0;  ///< frames that were passed over
  std::uint64_t skipped_bytes = 0;
  std::uint64_t checksum_failures = 0;
  std::uint64_t skipped_in_a_row = 0;
  std::uint64_t unchecked_in_a_row = 0;
};

/// Returns whole frames in order, regardless of how the stream is divided into chunks. After a
/// false start it resumes one byte later, so that a corrupt byte destroys only its own frame.
template <FrameProtocol Protocol>
class FrameDecoder {
 public:
  /// Calls `on_frame(Bytes)` for each frame that `chunk` completes.
  template <class OnFrame>
  void feed(Bytes chunk, OnFrame&& on_frame) {
    pending_.insert(pending_.end(), chunk.begin(), chunk.end());
    std::size_t start = 0;
    while (start < pending_.size()) {
      const Bytes rest = Bytes(pending_).subspan(start);
      const FrameCheck check = Protocol::examine(rest);
      if (check.kind == FrameKind::kIncomplete) {
        CREPES_EXPECT(rest.size() < Protocol::kMaxFrame, "a protocol knows its longest frame");
        break;
      }
      count(check.kind);
      if (check.kind == FrameKind::kComplete) on_frame(rest.first(check.length));
      const bool is_whole =
          check.kind == FrameKind::kComplete || check.kind == FrameKind::kUnchecked;
      start += is_whole ? check.length : 1;
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(start));
  }

  [[nodiscard]] const DecoderCounts& counts() const { return counts_; }

 private:
  void count(FrameKind kind) {
    if (kind == FrameKind::kComplete) {
      ++counts_.frames;
      counts_.skipped_in_a_row = 0;
      counts_.unchecked_in_a_row = 0;
      return;
    }
    if (kind == FrameKind::kUnchecked) {
      ++counts_.unchecked;
      ++counts_.unchecked_in_a_row;
      return;
    }
    ++counts_.skipped_bytes;
    ++counts_.skipped_in_a_row;
    if (kind == FrameKind::kBadChecksum) ++counts_.checksum_failures;
  }

  std::vector<std::uint8_t> pending_;
  DecoderCounts counts_;
};

}  // namespace crepes
