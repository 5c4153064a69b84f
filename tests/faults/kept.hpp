/// Schedules that broke a promise once: kept.txt.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/faults/trial.hpp"

namespace crepes::faults {

/// A line of kept.txt: a schedule, before it "open" and each promise that it still breaks with how
/// badly at most, e.g. "open error 0.09 present 1.2 four 4 open: ...".
struct KeptTrial {
  Trial trial;
  std::map<Promise, double> allowed;  ///< empty: it is mended

  [[nodiscard]] bool is_open() const { return !allowed.empty(); }
};

[[nodiscard]] std::optional<KeptTrial> parse_kept(const std::string& line);
/// As a line of kept.txt, with a quarter more than what was found.
[[nodiscard]] std::string kept_line(const Verdict& verdict);
/// All of tests/faults/kept.txt. Aborts at a line that is none.
[[nodiscard]] std::vector<KeptTrial> kept_trials();

/// What is worse than allowed, a line each.
[[nodiscard]] std::vector<std::string> unexpected(const Verdict& verdict,
                                                  const std::map<Promise, double>& allowed);
/// What was allowed and did not happen, a line each. It may happen on another processor.
[[nodiscard]] std::vector<std::string> kept_again(const Verdict& verdict,
                                                  const std::map<Promise, double>& allowed);

}  // namespace crepes::faults
