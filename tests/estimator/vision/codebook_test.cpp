#include "estimator/vision/codebook.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <set>

namespace crepes::codebook_test {
namespace {

std::string shifted(const std::string& pattern, std::size_t shift) {
  return pattern.substr(shift) + pattern.substr(0, shift);
}

std::size_t hamming(const std::string& a, const std::string& b) {
  std::size_t differing = 0;
  for (std::size_t i = 0; i < a.size(); ++i) differing += a[i] != b[i] ? 1 : 0;
  return differing;
}

/// Every rule, the slow way; the first that is broken, or nothing.
std::string broken_rule(const Codebook& book, const CodebookRules& rules) {
  for (const std::string& a : book.patterns) {
    if (a.size() != rules.slots) return a + " has a wrong length";
    if ((a + a).find(std::string(rules.max_dark + 1, '0')) != std::string::npos)
      return a + " is dark for too long";
    if (hamming(a, std::string(rules.slots, '1')) < rules.distance) return a + " is nearly steady";
    for (std::size_t shift = 0; shift < rules.slots; ++shift) {
      const std::string there = shifted(a, shift);
      if (there < a) return a + " does not start where it should";
      if (shift > 0 && hamming(a, there) < rules.distance) return a + " is nearly periodic";
      for (const std::string& b : book.patterns) {
        if (&a != &b && hamming(b, there) < rules.distance) return a + " is too near to " + b;
      }
    }
  }
  return std::ranges::is_sorted(book.patterns) ? "" : "not in order";
}

/// What a camera of two frames a slot surely sees, drawn out: 1, 0, or ? on an edge between the
/// two. Frames fall on the beginning and into the middle of each slot.
std::string frames_of(const std::string& pattern) {
  std::string frames;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    const char before = pattern[(i + pattern.size() - 1) % pattern.size()];
    frames += before == pattern[i] ? pattern[i] : '?';
    frames += pattern[i];
  }
  return frames;
}

std::size_t clear_frames_drawn_out(const std::string& a, const std::string& b) {
  const std::string frames_a = frames_of(a);
  std::size_t least = frames_a.size();
  for (std::size_t shift = 0; shift < frames_a.size(); ++shift) {
    const std::string frames_b = shifted(frames_of(b), shift);
    std::size_t clear = 0;
    for (std::size_t i = 0; i < frames_a.size(); ++i) {
      if (frames_a[i] != '?' && frames_b[i] != '?' && frames_a[i] != frames_b[i]) ++clear;
    }
    least = std::min(least, clear);
  }
  return least;
}

std::string any_pattern(std::size_t slots) {
  return *rc::gen::container<std::string>(slots, rc::gen::element('0', '1'));
}

TEST(Codebook, FindsSixtyFourIdsInTwentySlots) {
  const CodebookRules rules{.slots = 20, .distance = 4, .max_dark = 2};

  const Codebook book = search_codebook(rules, 64);

  EXPECT_EQ(book.patterns.size(), 64U);
  EXPECT_EQ(broken_rule(book, rules), "");
  EXPECT_GE(book.clear_frames, 2U);
}

TEST(Codebook, KeepsEveryRuleWhateverIsAskedFor) {
  EXPECT_TRUE(rc::check([] {
    CodebookRules rules;
    rules.slots = *rc::gen::inRange<std::size_t>(8, 33);
    rules.distance = *rc::gen::inRange<std::size_t>(1, 7);
    rules.max_dark = *rc::gen::inRange<std::size_t>(1, 5);
    const auto ids = *rc::gen::inRange<std::size_t>(1, 6);
    const auto seed = *rc::gen::inRange<std::uint64_t>(0, 1000);

    const Codebook book = search_codebook(rules, ids, {.seed = seed, .steps = 5000});

    RC_ASSERT(book.patterns.size() <= ids);
    RC_ASSERT(broken_rule(book, rules) == "");
  }));
}

TEST(Codebook, FindsTheSameForTheSameSeedAndOthersForAnother) {
  const CodebookRules rules{.slots = 16, .distance = 3, .max_dark = 2};

  const Codebook book = search_codebook(rules, 12, {.seed = 5, .steps = 50'000});

  EXPECT_EQ(search_codebook(rules, 12, {.seed = 5, .steps = 50'000}).patterns, book.patterns);
  EXPECT_NE(search_codebook(rules, 12, {.seed = 6, .steps = 50'000}).patterns, book.patterns);
}

TEST(Codebook, GivesTheMostItFoundWhereThereAreTooFew) {
  // Of eight slots with one dark at a time and four dark in all there is the alternating one alone,
  // which is periodic.
  EXPECT_TRUE(search_codebook({.slots = 8, .distance = 4, .max_dark = 1}, 4).patterns.empty());

  const CodebookRules rules{.slots = 12, .distance = 4, .max_dark = 2};
  const Codebook book = search_codebook(rules, 64, {.steps = 100'000});
  EXPECT_GT(book.patterns.size(), 2U);
  EXPECT_LT(book.patterns.size(), 64U);
  EXPECT_EQ(broken_rule(book, rules), "");
}

TEST(Codebook, MeasuresDistanceAndClearFramesAsDrawnOut) {
  EXPECT_TRUE(rc::check([] {
    const auto slots = *rc::gen::inRange<std::size_t>(8, 33);
    const std::string a = any_pattern(slots);
    const std::string b = any_pattern(slots);
    std::size_t distance = slots;
    for (std::size_t shift = 0; shift < slots; ++shift)
      distance = std::min(distance, hamming(a, shifted(b, shift)));

    RC_ASSERT(cyclic_distance(a, b) == distance);
    RC_ASSERT(clear_frames(a, b) == clear_frames_drawn_out(a, b));
  }));
}

TEST(Codebook, CountsMovedEdgesLessThanAddedFlashes) {
  const std::string pattern = "11110000111100001111";
  const std::string edges_moved = "11111000111100011111";
  const std::string flash_added = "11110110111100001111";

  EXPECT_EQ(cyclic_distance(pattern, edges_moved), 2U);
  EXPECT_EQ(cyclic_distance(pattern, flash_added), 2U);
  EXPECT_LT(clear_frames(pattern, edges_moved), clear_frames(pattern, flash_added));
}

}  // namespace
}  // namespace crepes::codebook_test
