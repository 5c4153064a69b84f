#include "estimator/vision/codebook.hpp"

#include <algorithm>
#include <bit>
#include <random>

#include "estimator/core/contract.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {
namespace {

constexpr std::size_t kAttempts = 4;
constexpr std::size_t kStepsAReport = 200'000;

std::uint64_t rotated(std::uint64_t word, std::size_t length, std::size_t shift) {
  if (shift == 0) return word;
  const std::uint64_t mask = ~std::uint64_t{0} >> (64 - length);
  return ((word << shift) | (word >> (length - shift))) & mask;
}

std::size_t ones(std::uint64_t word) { return static_cast<std::size_t>(std::popcount(word)); }

/// A pattern as bits, and as seen by a camera with two frames a slot: frame 2i falls on the edge
/// before slot i, frame 2i+1 on the middle of slot i.
struct Word {
  std::size_t slots = 0;
  std::uint64_t lit = 0;          ///< bit i: slot i is lit
  std::uint64_t frame_lit = 0;    ///< bit i: frame i is lit; 0 if its state is uncertain
  std::uint64_t frame_known = 0;  ///< bit i: the state of frame i is certain

  Word(std::uint64_t bits, std::size_t length) : slots(length), lit(bits) {
    const std::uint64_t before = rotated(bits, length, 1);
    for (std::size_t i = 0; i < length; ++i) {
      const std::uint64_t here = (bits >> i) & 1U;
      const std::uint64_t is_edge = here ^ ((before >> i) & 1U);
      frame_lit |= (here & ~is_edge) << (2 * i) | here << (2 * i + 1);
      frame_known |= (is_edge ^ 1U) << (2 * i) | std::uint64_t{1} << (2 * i + 1);
    }
  }
};

/// The first slot becomes the highest bit, so that words and texts have the same order.
Word word_of(std::string_view pattern) {
  CREPES_EXPECT(!pattern.empty() && pattern.size() <= BlinkCode::kMaxSlots,
                "a pattern has 1 to 32 slots");
  std::uint64_t bits = 0;
  for (const char slot : pattern) bits = bits << 1U | (slot == '1' ? 1U : 0U);
  return {bits, pattern.size()};
}

std::string text_of(const Word& word) {
  std::string text;
  for (std::size_t i = word.slots; i-- > 0;) text += ((word.lit >> i) & 1U) != 0 ? '1' : '0';
  return text;
}

/// The smallest distance over the shifts from `first_shift` on. If it is below `enough`, the result
/// is only some value below `enough`.
std::size_t distance(const Word& a, const Word& b, std::size_t enough, std::size_t first_shift) {
  std::size_t least = a.slots;
  for (std::size_t shift = first_shift; shift < a.slots && least >= enough; ++shift)
    least = std::min(least, ones(a.lit ^ rotated(b.lit, b.slots, shift)));
  return least;
}

std::size_t clear(const Word& a, const Word& b, std::size_t enough) {
  const std::size_t frames = 2 * a.slots;
  std::size_t least = frames;
  for (std::size_t shift = 0; shift < frames && least >= enough; ++shift) {
    const std::uint64_t known = a.frame_known & rotated(b.frame_known, frames, shift);
    least = std::min(least, ones((a.frame_lit ^ rotated(b.frame_lit, frames, shift)) & known));
  }
  return least;
}

/// Whether a word keeps the rules that concern no other word.
bool is_sound(const Word& word, const CodebookRules& rules) {
  std::uint64_t dark_run = ~word.lit & (~std::uint64_t{0} >> (64 - word.slots));
  if (ones(dark_run) < rules.distance) return false;
  // Bit i stays set while the slots i, i-1, ... are dark.
  for (std::size_t i = 0; i < rules.max_dark; ++i) dark_run &= rotated(dark_run, word.slots, 1);
  return dark_run == 0 && distance(word, word, rules.distance, 1) >= rules.distance;
}

/// A random word of `rules.slots` without long dark runs. A run across its end may be too long.
Word draw(const CodebookRules& rules, std::mt19937_64& random) {
  const std::uint64_t bits = random();
  std::uint64_t lit = 0;
  std::size_t dark = 0;
  for (std::size_t i = 0; i < rules.slots; ++i) {
    const bool is_lit = ((bits >> i) & 1U) != 0 || dark == rules.max_dark;
    dark = is_lit ? 0 : dark + 1;
    if (is_lit) lit |= std::uint64_t{1} << i;
  }
  return {lit, rules.slots};
}

/// Whether two words are too similar for one set.
bool are_rivals(const Word& a, const Word& b, std::size_t least_distance, std::size_t least_clear) {
  return distance(a, b, least_distance, 0) < least_distance ||
         (least_clear > 0 && clear(a, b, least_clear) < least_clear);
}

/// One attempt. A drawn word without rival in the set is added. A word with exactly one rival
/// replaces it: the search then continues from another set of the same size.
std::vector<Word> attempt(const CodebookRules& rules, std::size_t least_clear, std::size_t ids,
                          const CodebookSearch& search, std::mt19937_64& random) {
  std::vector<Word> words;
  std::size_t steps = 0;  // words drawn and words compared
  std::size_t reported = 0;
  for (; steps < search.steps && words.size() < ids; ++steps) {
    if (search.on_progress && steps >= reported) {
      search.on_progress(words.size(), least_clear);
      reported += kStepsAReport;
    }
    const Word word = draw(rules, random);
    if (!is_sound(word, rules)) continue;
    std::size_t rivals = 0;
    std::size_t rival = 0;
    for (std::size_t i = 0; i < words.size() && rivals < 2; ++i, ++steps) {
      if (!are_rivals(word, words[i], rules.distance, least_clear)) continue;
      rival = i;
      ++rivals;
    }
    if (rivals == 0) words.push_back(word);
    if (rivals == 1) words[rival] = word;
  }
  return words;
}

Codebook codebook_of(const std::vector<Word>& words) {
  Codebook book;
  if (words.empty()) return book;
  book.clear_frames = 2 * words.front().slots;
  for (std::size_t i = 0; i < words.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      book.clear_frames = std::min(book.clear_frames, clear(words[i], words[j], 0));
    const std::string text = text_of(words[i]);
    std::string least = text;
    for (std::size_t k = 1; k < text.size(); ++k)
      least = std::min(least, text.substr(k) + text.substr(0, k));
    book.patterns.push_back(std::move(least));
  }
  std::ranges::sort(book.patterns);
  return book;
}

}  // namespace

std::size_t cyclic_distance(std::string_view a, std::string_view b) {
  CREPES_EXPECT(a.size() == b.size(), "patterns of one length");
  return distance(word_of(a), word_of(b), 0, 0);
}

std::size_t clear_frames(std::string_view a, std::string_view b) {
  CREPES_EXPECT(a.size() == b.size(), "patterns of one length");
  return clear(word_of(a), word_of(b), 0);
}

Codebook search_codebook(const CodebookRules& rules, std::size_t ids,
                         const CodebookSearch& search) {
  CREPES_EXPECT(rules.slots >= 1 && rules.slots <= BlinkCode::kMaxSlots,
                "a pattern has 1 to 32 slots");
  std::mt19937_64 random(search.seed);
  std::vector<Word> best;
  // Requires one more clear frame after each complete set, until no complete set is found.
  bool is_whole = true;
  for (std::size_t least_clear = 0; is_whole && least_clear <= 2 * rules.slots; ++least_clear) {
    is_whole = false;
    for (std::size_t i = 0; i < kAttempts && !is_whole; ++i) {
      std::vector<Word> words = attempt(rules, least_clear, ids, search, random);
      is_whole = words.size() == ids;
      if (is_whole || (least_clear == 0 && words.size() > best.size())) best = std::move(words);
    }
  }
  return codebook_of(best);
}

}  // namespace crepes
