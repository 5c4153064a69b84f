#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "tests/fuzz/fuzz_targets.hpp"

namespace crepes::fuzz_test {
namespace {

using Random = std::mt19937;

std::size_t below(Random& random, std::size_t end) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
}

/// One fault on a line, in memory or of a person.
void damage(FuzzInput& input, const FuzzInput& other, Random& random) {
  constexpr std::array<std::uint8_t, 6> kTelling{0x00, 0x01, 0x7f, 0x80, 0xfe, 0xff};
  if (input.empty()) input.push_back(0);
  const std::size_t at = below(random, input.size());
  const auto place = input.begin() + static_cast<std::ptrdiff_t>(at);
  switch (below(random, 6)) {
    case 0:
      input[at] ^= static_cast<std::uint8_t>(1U << below(random, 8));
      break;
    case 1:
      input[at] = kTelling[below(random, kTelling.size())];
      break;
    case 2:
      input.erase(place,
                  place + static_cast<std::ptrdiff_t>(
                              1 + below(random, std::min<std::size_t>(8, input.end() - place))));
      break;
    case 3:
      input.insert(place, static_cast<std::uint8_t>(below(random, 256)));
      break;
    case 4:
      input.resize(at);
      break;
    default:
      if (!other.empty())
        input.insert(place, other.begin(),
                     other.begin() + static_cast<std::ptrdiff_t>(below(random, other.size())));
  }
}

class Fuzz : public testing::TestWithParam<FuzzTarget> {};

TEST_P(Fuzz, HoldsForEveryKeptInput) {
  const auto seeds = GetParam().seeds();
  ASSERT_FALSE(seeds.empty());
  for (const FuzzInput& input : seeds) GetParam().run(input);
  for (const FuzzInput& input : kept_inputs(GetParam().name)) GetParam().run(input);
}

TEST_P(Fuzz, HoldsForDamagedInputs) {
  constexpr std::size_t kBytes = 8'000'000;  // in all: as much for long inputs as for short ones
  constexpr std::size_t kLongest = 8192;
  std::vector<FuzzInput> inputs = GetParam().seeds();
  for (FuzzInput& input : kept_inputs(GetParam().name)) inputs.push_back(std::move(input));
  Random random(1);
  for (std::size_t bytes = 0; bytes < kBytes;) {
    FuzzInput input = inputs[below(random, inputs.size())];
    for (std::size_t i = 1 + below(random, 6); i > 0; --i)
      damage(input, inputs[below(random, inputs.size())], random);
    input.resize(std::min(input.size(), kLongest));
    GetParam().run(input);
    bytes += GetParam().cost * (input.size() + 64);
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, Fuzz,
                         testing::ValuesIn(fuzz_targets().begin(), fuzz_targets().end()),
                         [](const auto& target) { return std::string(target.param.name); });

}  // namespace
}  // namespace crepes::fuzz_test
