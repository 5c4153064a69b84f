/// fault_campaign: swarms with faults over many seeds. See README.md.
#include <fmt/core.h>

#include <CLI/CLI.hpp>

#include "tests/faults/trial.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Swarms with faults on virtual time, by seed", "fault_campaign"};
  std::uint64_t first = 1;
  std::uint64_t count = 100;
  app.add_option("--first", first, "the first seed")->capture_default_str();
  app.add_option("--seeds", count, "how many")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  std::uint64_t failed = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const auto verdict = crepes::faults::try_seed(seed);
    if (verdict.broken.empty()) continue;
    ++failed;
    fmt::print("seed {}\n", seed);
    for (const auto& fault : verdict.faults) fmt::print("  {}\n", to_string(fault));
    for (const std::string& line : verdict.broken) fmt::print("    {}\n", line);
    std::fflush(stdout);
  }
  fmt::print("{} of {} seeds broke a promise\n", failed, count);
  return failed == 0 ? 0 : 1;
}
