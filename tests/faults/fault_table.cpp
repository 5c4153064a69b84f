#include "tests/faults/fault_table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>

#include "estimator/core/quantile.hpp"

namespace crepes::faults {
namespace {

struct Row {
  int tried = 0;
  int alone = 0;
  int blamed = 0;  ///< broken promises of which it is a cause
  double worst_m = 0.0;
  double beyond_s = 0.0;
  double heap_mb = 0.0;
  std::vector<double> recovery_s;
};

struct LogEntry {
  bool broken = false;
  double worst_m = 0.0;
  double beyond_s = 0.0;
  double recovery_s = 0.0;
  double heap_mb = 0.0;
  std::optional<Trial> trial;
  std::optional<Trial> smallest;
};

LogEntry read_entry(const std::string& line) {
  LogEntry entry;
  std::istringstream text(line);
  text >> entry.broken >> entry.worst_m >> entry.beyond_s >> entry.recovery_s >> entry.heap_mb;
  std::string rest;
  std::getline(text, rest);
  entry.trial = parse_trial(rest);
  entry.smallest = parse_trial(rest.substr(std::min(rest.find('#'), rest.size() - 1) + 1));
  return entry;
}

void add(const LogEntry& entry, std::map<std::string_view, Row>& rows) {
  const std::vector<Fault>& faults = entry.trial->faults;
  for (const Fault& fault : faults) ++rows[about(fault.kind).name].tried;
  if (entry.broken && entry.smallest)
    for (const Fault& fault : entry.smallest->faults) ++rows[about(fault.kind).name].blamed;
  if (faults.size() != 1) return;
  Row& row = rows[about(faults.front().kind).name];
  ++row.alone;
  row.worst_m = std::max(row.worst_m, entry.worst_m);
  row.beyond_s = std::max(row.beyond_s, entry.beyond_s);
  row.heap_mb = std::max(row.heap_mb, entry.heap_mb);
  row.recovery_s.push_back(entry.recovery_s);
}

}  // namespace

std::string log_line(const Verdict& verdict) {
  return fmt::format("{:d} {:.3f} {:.2f} {:.2f} {:.2f} {} # {}", !verdict.broken.empty(),
                     verdict.worst_m, verdict.beyond_s, verdict.recovery_s,
                     static_cast<double>(verdict.heap_growth) * 1e-6, to_string(verdict.trial),
                     to_string(Trial{verdict.trial.world, verdict.smallest}));
}

std::string table_of(const std::vector<std::string>& logs) {
  std::map<std::string_view, Row> rows;
  int trials = 0;
  int broken = 0;
  for (const std::string& log : logs) {
    std::ifstream file(log);
    for (std::string line; std::getline(file, line);) {
      const LogEntry entry = read_entry(line);
      if (!entry.trial) continue;
      ++trials;
      broken += entry.broken ? 1 : 0;
      add(entry, rows);
    }
  }
  std::string table = fmt::format(
      "{} of {} trials broke a promise.\n\n"
      "| fault | tried | cause of a broken promise | alone | worst error [m] | beyond 5 sigma [s] "
      "| "
      "heap [MB] | recovery [s]: median | worst |\n|---|---|---|---|---|---|---|---|---|\n",
      broken, trials);
  for (const KindOf& kind : kKinds) {
    const Row& row = rows[kind.name];
    std::vector<double> sorted_s = row.recovery_s;
    const double median_s = sorted_s.empty() ? 0.0 : upper_median(sorted_s);
    const double worst_s = row.recovery_s.empty() ? 0.0 : *std::ranges::max_element(row.recovery_s);
    table += fmt::format("| {} | {} | {} | {} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {:.1f} |\n",
                         kind.name, row.tried, row.blamed, row.alone, row.worst_m, row.beyond_s,
                         row.heap_mb, median_s, worst_s);
  }
  return table;
}

}  // namespace crepes::faults
