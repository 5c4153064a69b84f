#include "tests/faults/fault.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdio>

#include "tests/faults/dice.hpp"

namespace crepes::faults {

const KindOf& about(Kind kind) { return *std::ranges::find(kKinds, kind, &KindOf::kind); }

std::string to_string(const Fault& fault) {
  return fmt::format("{} r{} {:.3f} {:.3f} {:.2f} {}", about(fault.kind).name, fault.robot.value,
                     fault.from_s, fault.to_s, fault.rate, fault.seed);
}

std::optional<Fault> parse_fault(const std::string& text) {
  std::array<char, 32> name{};
  Fault fault;
  unsigned long long seed = 0;
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-vararg,cert-err34-c): the result is checked
  const int read = std::sscanf(text.c_str(), " %31s r%hu %lf %lf %lf %llu", name.data(),
                               &fault.robot.value, &fault.from_s, &fault.to_s, &fault.rate, &seed);
  const auto* const kind = std::ranges::find(kKinds, std::string_view(name.data()), &KindOf::name);
  if (read != 6 || kind == kKinds.end()) return std::nullopt;
  fault.kind = kind->kind;
  fault.seed = seed;
  return fault;
}

std::vector<Fault> draw_faults(std::uint64_t seed, int robots, const FaultTimes& times) {
  const std::size_t kinds = seed > kLastSeedOfFirstKinds ? kKinds.size() : kFirstKinds;
  Dice dice(seed);
  std::vector<Fault> faults(seed % 2 == 0 ? 1 : 2 + dice.below(2));
  for (Fault& fault : faults) {
    fault.kind = kKinds.at(dice.below(kinds)).kind;
    fault.robot = RobotId{static_cast<std::uint16_t>(1 + dice.below(std::uint64_t(robots)))};
    fault.from_s = dice.between(times.from_s, times.to_s - 0.5);
    const bool is_without_sight = fault.kind == Kind::kUwbNoSight;
    const double longest_s = is_without_sight ? times.longest_without_sight_s : times.longest_s;
    const double end_s = std::max(times.to_s, times.from_s + longest_s);
    fault.to_s = dice.between(fault.from_s + 0.1, std::min(end_s, fault.from_s + longest_s));
    fault.rate = dice.between(0.2, 1.0);
    fault.seed = dice.below(1000000);
    fault = *parse_fault(to_string(fault));  // as it is printed, it can be repeated
  }
  return faults;
}

}  // namespace crepes::faults
