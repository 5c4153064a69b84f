/// What became of every kind of fault in a campaign.
#pragma once

#include <string>
#include <vector>

#include "tests/faults/trial.hpp"

namespace crepes::faults {

/// A trial in a campaign's log: numbers, then the schedule.
[[nodiscard]] std::string log_line(const Verdict& verdict);

/// A table in Markdown: kind, trials, broken promises; and of the trials with that fault alone, the
/// worst error and the time to recover.
[[nodiscard]] std::string table_of(const std::vector<std::string>& logs);

}  // namespace crepes::faults
