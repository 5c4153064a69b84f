#include "tests/faults/kept.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "estimator/core/contract.hpp"
#include "tests/support/places.hpp"

namespace crepes::faults {
namespace {

/// How badly each promise was broken.
std::map<Promise, double> worst_of(const std::vector<Broken>& broken) {
  std::map<Promise, double> worst;
  for (const Broken& one : broken) {
    double& size = worst.try_emplace(one.promise, one.size).first->second;
    size = std::max(size, one.size);
  }
  return worst;
}

}  // namespace

std::optional<KeptTrial> parse_kept(const std::string& line) {
  KeptTrial kept;
  std::istringstream text(line);
  std::string word;
  text >> word;
  const bool is_open = word == "open";
  if (is_open) text >> word;
  for (double size = 0.0; is_open && text; text >> word) {
    const auto promise = promise_of(word);
    if (!promise) break;
    text >> size;
    kept.allowed[*promise] = size;
  }
  std::string rest;
  std::getline(text, rest);
  const auto trial = parse_trial(word + rest);
  if (!trial || is_open == kept.allowed.empty()) return std::nullopt;
  kept.trial = *trial;
  return kept;
}

std::string kept_line(const Verdict& verdict) {
  constexpr double kMargin = 1.25;
  std::string line = "open";
  for (const auto& [promise, size] : worst_of(verdict.broken))
    line += fmt::format(" {} {:.3g}", name_of(promise), kMargin * size);
  return line + " " + to_string(verdict.trial);
}

std::vector<KeptTrial> kept_trials() {
  std::vector<KeptTrial> all;
  std::ifstream file(source_dir() + "/tests/faults/kept.txt");
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.starts_with('#')) continue;
    const auto kept = parse_kept(line);
    if (!kept) fmt::print(stderr, "no schedule: {}\n", line);
    CREPES_EXPECT(kept.has_value(), "kept.txt has schedules");
    all.push_back(*kept);
  }
  return all;
}

std::vector<std::string> unexpected(const Verdict& verdict,
                                    const std::map<Promise, double>& allowed) {
  std::vector<std::string> lines;
  for (const Broken& broken : verdict.broken) {
    const auto known = allowed.find(broken.promise);
    if (known == allowed.end() || !(broken.size <= known->second)) lines.push_back(broken.text);
  }
  return lines;
}

std::vector<std::string> kept_again(const Verdict& verdict,
                                    const std::map<Promise, double>& allowed) {
  std::vector<std::string> lines;
  const std::map<Promise, double> found = worst_of(verdict.broken);
  for (const auto& [promise, size] : allowed)
    if (!found.contains(promise))
      lines.push_back(
          fmt::format("{} is kept here: {}", name_of(promise), to_string(verdict.trial)));
  return lines;
}

}  // namespace crepes::faults
