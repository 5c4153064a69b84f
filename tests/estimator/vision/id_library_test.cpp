#include "estimator/vision/id_library.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace crepes::id_library_test {
namespace {

using namespace std::chrono_literals;

SwarmConfig swarm_of(std::vector<std::string> patterns) {
  SwarmConfig swarm;
  for (auto& pattern : patterns) {
    MemberConfig member;
    member.id = RobotId{static_cast<std::uint16_t>(swarm.members.size() + 1)};
    member.pattern = std::move(pattern);
    swarm.members.push_back(std::move(member));
  }
  return swarm;
}

std::string refusal(const SwarmConfig& swarm) {
  const auto library = IdLibrary::from(swarm);
  return library ? std::string() : library.error().message;
}

TEST(BlinkCode, IsLitInTheOnesOfItsPatternForEver) {
  const BlinkCode code = *BlinkCode::from_pattern("01101111", 10ms);

  for (const Duration start : {Duration{0ms}, Duration{80ms * 1000000}, Duration{-80ms * 3}}) {
    EXPECT_FALSE(code.is_lit(start));
    EXPECT_FALSE(code.is_lit(start + 9999us));
    EXPECT_TRUE(code.is_lit(start + 10ms));
    EXPECT_TRUE(code.is_lit(start + 29ms));
    EXPECT_FALSE(code.is_lit(start + 30ms));
    EXPECT_TRUE(code.is_lit(start + 79ms));
  }
}

TEST(BlinkCode, WithADutyIsLitForThatPartOfThePeriod) {
  const BlinkCode code = *BlinkCode::from_duty(0.3, 50ms);

  EXPECT_TRUE(code.is_lit(14ms));
  EXPECT_FALSE(code.is_lit(16ms));
  EXPECT_NEAR(code.lit_fraction(0ms, 50ms), 0.3, 1e-9);
}

TEST(BlinkCode, LitFractionIsTheMeanOfIsLit) {
  const BlinkCode code = *BlinkCode::from_pattern("0100110111010001", 10ms);
  EXPECT_TRUE(rc::check([&] {
    const Duration from{*rc::gen::inRange<std::int64_t>(-400'000'000, 400'000'000)};
    const Duration length{*rc::gen::inRange<std::int64_t>(1'000'000, 200'000'000)};

    int lit = 0;
    constexpr int kSamples = 2000;
    for (int i = 0; i < kSamples; ++i) lit += code.is_lit(from + length * i / kSamples) ? 1 : 0;

    // Each edge inside the interval costs at most one sample.
    RC_ASSERT(std::abs(code.lit_fraction(from, from + length) - double(lit) / kSamples) < 0.015);
  }));
}

TEST(IdLibrary, KeepsMembersInOrder) {
  const auto library = IdLibrary::from(swarm_of({"01111111", "00111111"}));

  ASSERT_TRUE(library.has_value());
  EXPECT_EQ(library->entries().size(), 2U);
  EXPECT_EQ(library->entries()[1].id, RobotId{2});
  EXPECT_EQ(library->entries()[1].code.period(), Duration{80ms});
}

TEST(IdLibrary, RefusesTwoMembersWithOneSignal) {
  EXPECT_NE(refusal(swarm_of({"01011111", "11101011"})).find("told apart"), std::string::npos);
  EXPECT_NE(refusal(swarm_of({"01010101", "1010101010"})).find("told apart"), std::string::npos);
  SwarmConfig duties = swarm_of({"", ""});
  for (MemberConfig& member : duties.members) member.pattern.reset(), member.duty = 0.3;
  EXPECT_NE(refusal(duties).find("told apart"), std::string::npos);
}

TEST(IdLibrary, RefusesADutyAndAPatternWithOneSignal) {
  const auto refuses = [](const std::string& pattern, double duty, double period_ms) {
    SwarmConfig swarm = swarm_of({pattern, ""});
    swarm.slot_ms = 5.0;
    swarm.period_ms = period_ms;
    swarm.members[1].pattern.reset();
    swarm.members[1].duty = duty;
    return refusal(swarm).find("told apart") != std::string::npos;
  };

  EXPECT_TRUE(refuses("11110000", 0.5, 40.0));
  EXPECT_TRUE(refuses("10000111", 0.51, 40.0));
  EXPECT_TRUE(refuses("0001100011", 0.4, 25.0));
  EXPECT_FALSE(refuses("11110000", 0.5, 50.0));
  EXPECT_FALSE(refuses("11110000", 0.6, 40.0));
  EXPECT_FALSE(refuses("11010001", 0.5, 40.0));
}

TEST(IdLibrary, RefusesCodesThatAreNoneAndSaysWhose) {
  EXPECT_NE(refusal(swarm_of({"01111111", "0111"})).find("members[1]: pattern: must have 8 to 32"),
            std::string::npos);
  EXPECT_NE(refusal(swarm_of({"0111111x"})).find("0 and 1"), std::string::npos);
  EXPECT_NE(refusal(swarm_of({"11111111"})).find("never changes"), std::string::npos);
  SwarmConfig both = swarm_of({"01111111"});
  both.members[0].duty = 0.3;
  EXPECT_NE(refusal(both).find("either"), std::string::npos);
  SwarmConfig twice = swarm_of({"01111111", "00111111"});
  twice.members[1].id = RobotId{1};
  EXPECT_NE(refusal(twice).find("taken"), std::string::npos);
}

}  // namespace
}  // namespace crepes::id_library_test
