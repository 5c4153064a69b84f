/// Sets of blink patterns that a camera can distinguish without being synchronized to the boards.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// The rules for a set of patterns. A pattern is a word of 1 (lit) and 0 (dark) that repeats for
/// ever. A camera does not know where it begins, so every rule holds for all cyclic shifts.
struct CodebookRules {
  std::size_t slots = 20;    ///< length of a pattern, 8 to 32
  std::size_t distance = 4;  ///< least number of slots in which two patterns differ in any shift, a
                             ///< pattern from its own shifts, and each from steady light
  std::size_t max_dark = 2;  ///< greatest number of dark slots in a row
};

/// Patterns that keep the rules. Each is the rotation that is first in alphabetical order, and the
/// patterns are in that order.
struct Codebook {
  std::vector<std::string> patterns;
  std::size_t clear_frames = 0;  ///< the smallest clear_frames() of any two patterns
};

/// The smallest number of slots in which `a` differs from a cyclic shift of `b`. Both have the same
/// length.
[[nodiscard]] std::size_t cyclic_distance(std::string_view a, std::string_view b);

/// How well two patterns can be distinguished in the worst case by a camera with two frames a slot.
/// In the worst case every second frame falls on the edge between two slots; its state is certain
/// only if both slots are equal. Returns the number of frames within one pattern's length in which
/// both states are certain and differ, at the worst shift by whole or half slots.
///
/// The cyclic distance alone is not sufficient: two patterns may differ mainly in edges that are
/// moved by one slot. Half a slot of timing error explains most of such a difference, so few of its
/// frames are clear.
[[nodiscard]] std::size_t clear_frames(std::string_view a, std::string_view b);

/// Settings of the search. It is random, bounded, and equal on all machines for equal seeds.
struct CodebookSearch {
  std::uint64_t seed = 1;
  std::size_t steps = 2'000'000;  ///< words drawn and compared in an attempt, of which there are
                                  ///< four for each number of clear frames
  /// Called from time to time with the number of patterns found so far, and the number of clear
  /// frames that the attempt requires of each pair.
  std::function<void(std::size_t found, std::size_t clear_frames)> on_progress{};
};

/// Searches `ids` patterns that keep the rules, with as many clear frames as possible. If it does
/// not find that many patterns, it returns the largest set that it found.
[[nodiscard]] Codebook search_codebook(const CodebookRules& rules, std::size_t ids,
                                       const CodebookSearch& search = {});

}  // namespace crepes
