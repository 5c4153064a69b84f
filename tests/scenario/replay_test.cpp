/// Whole swarms, recorded and replayed.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "daemon/ctl/replay/swarm_replay.hpp"
#include "daemon/ctl/score/swarm_score.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "estimator/core/constants.hpp"
#include "tests/scenario/recorded_swarm.hpp"
#include "tests/support/places.hpp"

namespace crepes::replay_test {
namespace {

namespace fs = std::filesystem;
using test::record_swarm;
using test::RecordingOptions;
using test::SpotSource;

class Replay : public testing::Test {
 protected:
  [[nodiscard]] fs::path path(const std::string& name) const { return scratch_.path() / name; }

  void record(const std::string& name, const RecordingOptions& options) {
    record_swarm(path(name), options);
  }

  SwarmScore replay(const fs::path& swarm, const std::string& out, Profile profile,
                    bool graph = true, double after_s = 5.0) {
    ReplayOptions options;
    options.swarm_dir = swarm;
    options.out_dir = path(out);
    options.profile = profile;
    options.graph = graph;
    const auto done = replay_swarm(options);
    EXPECT_TRUE(done) << done.error().message;
    const auto manifest = load_manifest(swarm);
    const auto truth = SwarmTruth::load(swarm, manifest.value());
    auto score = score_swarm(path(out), manifest.value(), truth.value(), after_s);
    EXPECT_TRUE(score) << score.error().message;
    EXPECT_EQ(id_mistakes(path(out)), 0U);
    return score.value();
  }

  /// Bearings that carried another robot's ID, as the replay itself found out from the truth.
  static std::uint64_t id_mistakes(const fs::path& out) {
    std::ifstream in(out / "report.json");
    std::uint64_t mistakes = 0;
    const auto report = nlohmann::json::parse(in);
    for (const auto& pair : report.at("pairs")) {
      mistakes += pair.at("id_mistakes").get<std::uint64_t>();
    }
    return mistakes;
  }

  /// All files of poses, byte for byte.
  [[nodiscard]] std::map<fs::path, std::string> poses(const std::string& out) const {
    std::map<fs::path, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(path(out))) {
      if (entry.path().extension() != ".csv") continue;
      std::ifstream in(entry.path());
      files[fs::relative(entry.path(), path(out))] = {std::istreambuf_iterator<char>(in), {}};
    }
    return files;
  }

 private:
  ScratchDirectory scratch_ = ScratchDirectory::create({}).value();
};

std::string name_of(const ScoredPair& pair) {
  return pair.observer.name + "->" + pair.neighbor.name;
}

double mean_rotation_rmse(const SwarmScore& score) {
  double sum = 0.0;
  for (const ScoredPair& pair : score.pairs) {
    sum += statistics_of(pair.score.rotation_errors_rad).rmse;
  }
  return sum / static_cast<double>(score.pairs.size());
}

/// What users are promised of every pair that is in view.
void expect_sound(const SwarmScore& score, double max_clock_error_s) {
  ASSERT_FALSE(score.pairs.empty());
  for (const ScoredPair& pair : score.pairs) {
    EXPECT_GE(pair.score.availability, 0.95) << name_of(pair);
    EXPECT_EQ(pair.score.bad_covariances, 0U) << name_of(pair);
    EXPECT_LE(pair.score.max_age, std::chrono::milliseconds{20}) << name_of(pair);
  }
  EXPECT_FALSE(score.clocks.empty());
  for (const ClockScore& clock : score.clocks) {
    EXPECT_LT(clock.max_error_s, max_clock_error_s) << clock.observer.value << clock.peer.value;
  }
}

void expect_accuracy(const SwarmScore& score, double median_m, double median_deg) {
  for (const ScoredPair& pair : score.pairs) {
    EXPECT_LE(statistics_of(pair.score.position_errors_m).median, median_m) << name_of(pair);
    EXPECT_LE(statistics_of(pair.score.rotation_errors_rad).median, radians(median_deg))
        << name_of(pair);
  }
}

TEST_F(Replay, FourSimulatedRobotsKnowEachOtherInBothProfiles) {
  record("four", {.scenario = SimScenario::kFour, .seed = 3, .duration_s = 12.0});

  for (const Profile profile : {Profile::kPaper, Profile::kTight}) {
    const SwarmScore score = replay(path("four"), "out", profile);

    EXPECT_EQ(score.pairs.size(), 12U);
    expect_sound(score, 1e-3);
    expect_accuracy(score, 0.16, 1.5);  // the paper's own figures on its own hardware
  }
}

TEST_F(Replay, TwoRunsAgreeToTheLastBit) {
  record("four", {.scenario = SimScenario::kFour, .seed = 4, .duration_s = 4.0});

  replay(path("four"), "first", Profile::kTight);
  replay(path("four"), "second", Profile::kTight);

  EXPECT_EQ(poses("first").size(), 12U);
  EXPECT_EQ(poses("first"), poses("second"));
}

TEST_F(Replay, HiddenNeighborsAreReachedThroughOthers) {
  record("occluded", {.scenario = SimScenario::kOccluded, .seed = 2, .duration_s = 15.0});

  const SwarmScore with_graph = replay(path("occluded"), "graph", Profile::kTight);
  const SwarmScore alone = replay(path("occluded"), "alone", Profile::kTight, false);

  expect_sound(with_graph, 1e-3);
  std::size_t reached = 0;
  for (const ScoredPair& pair : with_graph.pairs) {
    reached += pair.score.modes.at(static_cast<std::size_t>(PoseMode::kGraph));
    EXPECT_LT(statistics_of(pair.score.position_errors_m).rmse, 0.2) << name_of(pair);
  }
  EXPECT_GT(reached, 0U);
  for (const ScoredPair& pair : alone.pairs) {
    EXPECT_EQ(pair.score.modes.at(static_cast<std::size_t>(PoseMode::kGraph)), 0U);
  }
}

TEST_F(Replay, AMeshSlowerThanTheLagStillGivesPoses) {
  record("slow", {.scenario = SimScenario::kLine, .duration_s = 10.0, .latency_ms = 200.0});

  const SwarmScore score = replay(path("slow"), "out", Profile::kTight);

  EXPECT_EQ(score.pairs.size(), 12U);
  expect_sound(score, 1e-3);
  for (const ScoredPair& pair : score.pairs)
    EXPECT_LT(statistics_of(pair.score.position_errors_m).rmse, 0.2) << name_of(pair);
}

TEST_F(Replay, PicturesGiveThePosesOfIdealSpots) {
  record("pictures", {.seed = 5, .duration_s = 8.0, .spots = SpotSource::kPictures});
  record("projected", {.seed = 5, .duration_s = 8.0, .spots = SpotSource::kProjection});

  const SwarmScore pictures = replay(path("pictures"), "a", Profile::kTight, true, 2.0);
  const SwarmScore projected = replay(path("projected"), "b", Profile::kTight, true, 2.0);

  ASSERT_EQ(pictures.pairs.size(), projected.pairs.size());
  for (std::size_t i = 0; i < pictures.pairs.size(); ++i) {
    std::map<Timestamp, Pose> other;
    for (const NeighborPose& pose : projected.pairs[i].poses) other[pose.stamp] = pose.T_B_N.pose;
    std::vector<double> meters;
    std::vector<double> degrees;
    for (const NeighborPose& pose : pictures.pairs[i].poses) {
      const auto same = other.find(pose.stamp);
      if (same == other.end()) continue;
      const Vector6d d = pose_difference(pose.T_B_N.pose, same->second);
      meters.push_back(d.head<3>().norm());
      degrees.push_back(d.tail<3>().norm() * kDegPerRad);
    }
    ASSERT_GT(meters.size(), 300U);
    EXPECT_LT(statistics_of(meters).rmse, 0.02);
    EXPECT_LT(statistics_of(degrees).rmse, 0.3);
  }
}

TEST_F(Replay, TheNetworksSeedChangesWhatArrivesAndNothingBreaks) {
  record("two", {.seed = 6, .duration_s = 7.0});
  ReplayOptions options;
  options.swarm_dir = path("two");
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    options.out_dir = path("seed" + std::to_string(seed));
    options.seed = seed;

    const auto done = replay_swarm(options);

    ASSERT_TRUE(done) << done.error().message;
    EXPECT_GT(done->poses, 500U);
  }
  EXPECT_NE(poses("seed1"), poses("seed2"));
}

// Two robots that carry each other's module have no range, and say what to mend.
TEST_F(Replay, SaysWhoHasNoPoseAndWhatIsFaulty) {
  record("two", {.seed = 6, .duration_s = 5.0});
  ReplayOptions options;
  options.swarm_dir = path("two");
  options.out_dir = path("healthy");
  ASSERT_TRUE(replay_swarm(options)->notes.empty());

  for (const auto& [robot, was, is] :
       {std::tuple("r1", ",2,", ",1,"), std::tuple("r2", ",1,", ",2,")}) {
    const fs::path file = path("two") / robot / "uwb0" / "data.csv";
    std::ifstream in(file);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    for (std::size_t at = 0; (at = text.find(was, at)) != std::string::npos; ++at)
      text.replace(at, std::string_view(was).size(), is);
    std::ofstream(file) << text;
  }
  options.out_dir = path("swapped");
  const auto done = replay_swarm(options);
  ASSERT_TRUE(done);
  const auto count = [&](std::string_view what) {
    return std::ranges::count_if(
        done->notes, [&](const std::string& n) { return n.find(what) != std::string::npos; });
  };
  EXPECT_EQ(done->poses, 0U);
  EXPECT_EQ(count("no pose at any time"), 2) << testing::PrintToString(done->notes);
  EXPECT_EQ(count("its UWB module measures"), 4) << testing::PrintToString(done->notes);
}

/// The independent recordings, where they are at hand.
class RecordedSwarm : public Replay, public testing::WithParamInterface<const char*> {
 protected:
  [[nodiscard]] static fs::path dataset() {
    return fs::path(source_dir()) / "../shared/datasets" / GetParam();
  }
  void SetUp() override {
    if (!fs::exists(dataset())) GTEST_SKIP() << "no recording at " << dataset();
  }
};

TEST_P(RecordedSwarm, GivesSoundPosesInBothProfiles) {
  const double clock_error_s = std::string(GetParam()) == "bad-network" ? 2e-3 : 1e-3;

  expect_sound(replay(dataset(), "paper", Profile::kPaper), clock_error_s);
  expect_sound(replay(dataset(), "tight", Profile::kTight), clock_error_s);
}
INSTANTIATE_TEST_SUITE_P(Datasets, RecordedSwarm,
                         testing::Values("static", "two-manual", "two-duty", "four", "long-range",
                                         "occluded", "bad-network"));

class PaperAccuracy : public RecordedSwarm {};

TEST_P(PaperAccuracy, IsReachedByThePapersFilter) {
  expect_accuracy(replay(dataset(), "out", Profile::kPaper), 0.16, 1.5);
}
INSTANTIATE_TEST_SUITE_P(Datasets, PaperAccuracy, testing::Values("static", "two-manual", "four"));

class TeamRecording : public RecordedSwarm {};

TEST_P(TeamRecording, IsImprovedByTheGraph) {
  const double with_graph = mean_rotation_rmse(replay(dataset(), "graph", Profile::kPaper));
  const double alone = mean_rotation_rmse(replay(dataset(), "alone", Profile::kPaper, false));

  EXPECT_LT(with_graph, alone);
}
INSTANTIATE_TEST_SUITE_P(Datasets, TeamRecording, testing::Values("four"));

}  // namespace
}  // namespace crepes::replay_test
