/// soak [SECONDS [SEED]]: exit code 0 when everything recovered and nothing was wrong or grew.
#include "tests/soak/soak.hpp"

#include <algorithm>
#include <iostream>
#include <vector>

int main(int count, char** arguments) {
  using namespace crepes;
  using namespace std::chrono_literals;
  constexpr std::size_t kGrowthKb = 2048;
  const std::vector<std::string> words(arguments, arguments + count);
  const Duration duration = words.size() > 1 ? std::stoi(words[1]) * 1s : 600s;
  const SoakPlan plan{.duration = duration,
                      .warm_up = std::min<Duration>(60s, duration / 4),
                      .give_up = 10s,
                      .seed = words.size() > 2 ? static_cast<unsigned>(std::stoul(words[2])) : 1U};
  const SoakReport report = run_soak(plan);
  std::cout << to_string(report);
  const bool is_fine = report.stuck.empty() && report.wrong.empty() && report.longest() <= 2s &&
                       report.descriptors_after <= report.descriptors_before &&
                       report.memory_after_kb <= report.memory_before_kb + kGrowthKb;
  std::cout << (is_fine ? "fine\n" : "NOT fine\n");
  return is_fine ? 0 : 1;
}
