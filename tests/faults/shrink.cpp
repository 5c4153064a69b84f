#include "tests/faults/shrink.hpp"

#include <utility>

namespace crepes::faults {
namespace {

constexpr int kHalvings = 4;
constexpr double kShortest_s = 0.1;
constexpr double kLowestRate = 0.2;  // as faults are drawn

/// As a schedule is printed, so that it can be repeated.
Fault rounded(const Fault& fault) { return *parse_fault(to_string(fault)); }

Fault shorter(Fault fault) {
  fault.to_s = fault.from_s + (fault.to_s - fault.from_s) / 2;
  return rounded(fault);
}

Fault weaker(Fault fault) {
  fault.rate /= 2;
  return rounded(fault);
}

}  // namespace

std::vector<Fault> shrunk(std::vector<Fault> faults,
                          const std::function<bool(const std::vector<Fault>&)>& breaks) {
  const auto replaces = [&](std::vector<Fault> smaller) {
    if (!breaks(smaller)) return false;
    faults = std::move(smaller);
    return true;
  };
  for (std::size_t i = 0; faults.size() > 1 && i < faults.size();) {
    std::vector<Fault> fewer = faults;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    if (!replaces(std::move(fewer))) ++i;
  }
  const auto reduce = [&](std::size_t i, Fault (*smaller)(Fault), const auto& is_least) {
    for (int n = 0; n < kHalvings && !is_least(smaller(faults[i])); ++n) {
      std::vector<Fault> reduced = faults;
      reduced[i] = smaller(reduced[i]);
      if (!replaces(std::move(reduced))) return;
    }
  };
  for (std::size_t i = 0; i < faults.size(); ++i) {
    reduce(i, shorter, [](const Fault& f) { return f.to_s - f.from_s < kShortest_s; });
    if (about(faults[i].kind).rate.empty()) continue;
    reduce(i, weaker, [](const Fault& f) { return f.rate < kLowestRate; });
  }
  return faults;
}

}  // namespace crepes::faults
