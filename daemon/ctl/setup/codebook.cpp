#include "daemon/ctl/setup/codebook.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/ctl/json_line.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxIds = 1000;

std::string library_text(const CodebookOptions& options, const Codebook& book) {
  const auto& [slots, distance, max_dark] = options.rules;
  std::string text = fmt::format(
      "# Blink patterns, written by crepesctl codebook --ids {} --slots {} --distance {} "
      "--max-dark {} --seed {}\n"
      "# However shifted, any two differ in at least {} slots, and so does each from itself and "
      "from steady\n"
      "# light; never dark for more than {} slots. Add where LED ring and antenna are mounted, and "
      "leave out the\n"
      "# robots that you do not have: the fewer there are, the sooner one is recognized.\n"
      "swarm:\n  members:\n",
      options.ids, slots, distance, max_dark, options.search.seed, distance, max_dark);
  for (std::size_t i = 0; i < book.patterns.size(); ++i) {
    text +=
        fmt::format("    - {{id: {0}, name: r{0}, pattern: \"{1}\"}}\n", i + 1, book.patterns[i]);
  }
  return text;
}

std::string library_json(const Codebook& book) {
  Json members = Json::array();
  for (const std::string& pattern : book.patterns) {
    const std::size_t id = members.size() + 1;
    members.push_back({{"id", id}, {"name", fmt::format("r{}", id)}, {"pattern", pattern}});
  }
  return json_line({{"swarm", {{"members", std::move(members)}}}});
}

/// The smallest change of one rule that yields enough patterns; empty if none does.
std::string remedy(const CodebookOptions& options, const char* flag,
                   std::size_t CodebookRules::*rule, const std::vector<std::size_t>& values) {
  for (const std::size_t value : values) {
    CodebookRules rules = options.rules;
    rules.*rule = value;
    const Codebook book = search_codebook(rules, options.ids, options.search);
    if (book.patterns.size() == options.ids) return fmt::format("\n  {} {}", flag, value);
  }
  return "";
}

std::vector<std::size_t> numbers(std::size_t first, std::size_t last) {
  std::vector<std::size_t> values;
  for (std::size_t value = first; value <= last; ++value) values.push_back(value);
  return values;
}

Error shortfall(const CodebookOptions& options, std::size_t found) {
  const auto& [slots, distance, max_dark] = options.rules;
  std::vector<std::size_t> distances = numbers(1, distance - 1);
  std::ranges::reverse(distances);
  const std::string remedies =
      remedy(options, "--distance", &CodebookRules::distance, distances) +
      remedy(options, "--slots", &CodebookRules::slots, numbers(slots + 1, BlinkCode::kMaxSlots)) +
      remedy(options, "--max-dark", &CodebookRules::max_dark, numbers(max_dark + 1, slots / 2)) +
      (found > 0 ? fmt::format("\n  --ids {}", found) : "");
  return {
      ErrorCode::kConfig,
      fmt::format(
          "codebook: found {} of {} patterns of {} slots with distance {}, dark for at most {}{}",
          found, options.ids, slots, distance, max_dark,
          remedies.empty() ? "; and no single change is enough"
                           : "; any one of these is enough:" + remedies)};
}

Result<void> check(const CodebookOptions& options) {
  const auto& [slots, distance, max_dark] = options.rules;
  const auto refuse = [](const std::string& why) { return fail(ErrorCode::kUsage, why); };
  if (options.ids < 1 || options.ids > kMaxIds) return refuse("--ids: must be 1 to 1000");
  if (slots < BlinkCode::kMinSlots || slots > BlinkCode::kMaxSlots)
    return refuse("--slots: must be 8 to 32");
  if (distance < 1 || distance > slots) return refuse("--distance: must be 1 to --slots");
  if (max_dark < 1 || max_dark >= slots) return refuse("--max-dark: must be 1 to --slots less 1");
  return {};
}

}  // namespace

Result<std::string> codebook(const CodebookOptions& options) {
  if (auto good = check(options); !good) return tl::unexpected(good.error());
  const Codebook book = search_codebook(options.rules, options.ids, options.search);
  if (book.patterns.size() < options.ids)
    return tl::unexpected(shortfall(options, book.patterns.size()));
  return options.json ? library_json(book) : library_text(options, book);
}

}  // namespace crepes
