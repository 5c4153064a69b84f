#include "tests/faults/fault.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "tests/faults/dice.hpp"

namespace crepes::faults {

const KindOf& about(Kind kind) { return *std::ranges::find(kKinds, kind, &KindOf::kind); }

std::string to_string(const Fault& fault) {
  return fmt::format("{} of r{} from {:.2f} to {:.2f} s", about(fault.kind).name, fault.robot.value,
                     fault.from_s, fault.to_s);
}

std::vector<Fault> draw_faults(std::uint64_t seed, int robots, double from_s, double to_s) {
  Dice dice(seed);
  std::vector<Fault> faults(1 + dice.below(3));
  for (Fault& fault : faults) {
    fault.kind = kKinds.at(dice.below(kKinds.size())).kind;
    fault.robot = RobotId{static_cast<std::uint16_t>(1 + dice.below(std::uint64_t(robots)))};
    fault.from_s = dice.between(from_s, to_s - 0.5);
    fault.to_s = dice.between(fault.from_s + 0.1, to_s);
    fault.seed = dice.next();
  }
  return faults;
}

}  // namespace crepes::faults
