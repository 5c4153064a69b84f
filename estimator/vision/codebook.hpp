/// Sets of blink patterns that an unsynchronized camera can distinguish.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// What patterns must keep. A pattern is a word of 1 (lit) and 0 (dark), repeated for ever from an
/// unknown phase, so every rule holds for all its cyclic shifts.
struct CodebookRules {
  std::size_t slots = 20;    ///< length of a pattern, 8 to 32
  std::size_t distance = 4;  ///< slots in which any two patterns differ, in every shift; each from
                             ///< itself shifted and from steady light, too
  std::size_t max_dark = 2;  ///< dark slots in a row
};

/// Patterns that keep the rules, each in its least rotation, in ascending order.
struct Codebook {
  std::vector<std::string> patterns;
  std::size_t clear_frames = 0;  ///< the least of any two, see clear_frames()
};

/// The least number of slots in which `a` and a shift of `b` differ. Both have the same length.
[[nodiscard]] std::size_t cyclic_distance(std::string_view a, std::string_view b);

/// How well a camera that takes two frames a slot tells two patterns apart when it is unlucky, that
/// is, when every other frame falls on an edge between slots: the frames of one pattern's length
/// that surely differ, at the worst shift by whole or half slots. A frame on an edge is sure where
/// both slots beside it are alike. Of two pairs at the same distance, one whose edges are merely
/// moved by a slot has fewer: half a slot of timing error explains most of it.
[[nodiscard]] std::size_t clear_frames(std::string_view a, std::string_view b);

/// How to search: at random, but the same on every machine, and bounded in steps.
struct CodebookSearch {
  std::uint64_t seed = 1;
  std::size_t steps = 2'000'000;  ///< words drawn and compared before giving up, four times over
  /// Told from time to time: how many patterns with so many clear frames are found by now.
  std::function<void(std::size_t found, std::size_t clear_frames)> on_progress{};
};

/// Searches `ids` patterns; among sets that keep the rules, one with many clear frames. Holds fewer
/// patterns, the most that were found, when there seem to be no more.
[[nodiscard]] Codebook search_codebook(const CodebookRules& rules, std::size_t ids,
                                       const CodebookSearch& search = {});

}  // namespace crepes
