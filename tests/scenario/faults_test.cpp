/// Swarms with faults, a small part of the campaign in tests/faults.
#include <gtest/gtest.h>

#include "tests/faults/trial.hpp"
#include "tests/study/simulated_swarm.hpp"

namespace crepes {
namespace {

class Faults : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Faults, LeaveTheOthersHonestAndEndWithTheirCause) {
  const faults::Verdict verdict = faults::try_seed(GetParam());

  std::string schedule;
  for (const faults::Fault& fault : verdict.faults) schedule += to_string(fault) + "\n";
  for (const std::string& line : verdict.broken) ADD_FAILURE() << line << "\nwith\n" << schedule;
}

INSTANTIATE_TEST_SUITE_P(Seeds, Faults, testing::Range(std::uint64_t{1}, std::uint64_t{13}));

TEST(FaultTrial, IsTheSameToTheBitWhenRepeated) {
  const study::Swarm swarm = study::simulate_swarm(study::kScenarios[2], 3, 8.0);
  std::vector<faults::Fault> all;
  for (const faults::KindOf& kind : faults::kKinds)
    all.push_back({.kind = kind.kind, .robot = RobotId{2}, .from_s = 4.0, .to_s = 4.5, .seed = 7});

  const faults::Outcome first = faults::run(swarm, all, 6.0);
  const faults::Outcome second = faults::run(swarm, all, 6.0);
  const faults::Outcome without = faults::run(swarm, {}, 6.0);

  for (const auto& [pair, outcome] : first) {
    EXPECT_EQ(outcome.hash, second.at(pair).hash);
    EXPECT_NE(outcome.hash, without.at(pair).hash);
    EXPECT_EQ(outcome.not_finite, 0U);
  }
}

TEST(FaultTrial, TellsBrokenPromises) {
  const faults::Pair pair{RobotId{1}, RobotId{2}};
  const faults::Outcome reference{{pair, {.rmse_m = 0.02}}};
  const std::vector<faults::Fault> loss{{.kind = faults::Kind::kLoss, .robot = RobotId{1}}};
  const std::vector<faults::Fault> stuck{{.kind = faults::Kind::kImuStuck, .robot = RobotId{1}}};
  const auto count = [&](const faults::PairOutcome& outcome, const auto& cause) {
    return broken_promises(cause, {{pair, outcome}}, reference).size();
  };

  EXPECT_EQ(count({.rmse_m = 0.03}, loss), 0U);
  EXPECT_EQ(count({.not_finite = 1, .rmse_m = 0.03}, loss), 1U);
  EXPECT_EQ(count({.longest_beyond_s = 0.6, .rmse_m = 0.03}, loss), 1U);
  EXPECT_EQ(count({.longest_beyond_s = 0.6, .rmse_m = 0.03}, stuck), 0U);
  EXPECT_EQ(count({.longest_absence_s = 0.6, .rmse_m = 0.03}, stuck), 1U);
  EXPECT_EQ(count({.rmse_m = 0.2}, stuck), 1U);
}

}  // namespace
}  // namespace crepes
