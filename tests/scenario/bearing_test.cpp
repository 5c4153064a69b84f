/// What the tracker alone makes of whole recordings: who is identified, where, and how exactly.
#include <gtest/gtest.h>

#include "drivers/base/scratch_directory.hpp"
#include "estimator/core/constants.hpp"
#include "tests/scenario/recorded_swarm.hpp"
#include "tests/support/bearing_truth.hpp"
#include "tests/support/places.hpp"

namespace crepes::bearing_test {
namespace {

namespace fs = std::filesystem;
using test::SeenNeighbor;

using SeenPairs = std::vector<std::pair<std::string, SeenNeighbor>>;

/// All pairs of the recording, from two seconds on; pictures become spots first.
SeenPairs watch_all(const fs::path& dir) {
  auto swarm = load_swarm(dir).value();
  const auto truth = SwarmTruth::load(dir, swarm.manifest).value();
  SeenPairs pairs;
  for (RobotRecording& robot : swarm.robots) {
    if (robot.cameras.front().spots.empty()) test::detect_spots(robot);
    for (auto& [id, seen] : test::watch_neighbors(robot, truth, std::chrono::seconds{2}))
      pairs.emplace_back(robot.robot.name + " sees " + std::to_string(id.value), std::move(seen));
  }
  return pairs;
}

double identified_share(const SeenNeighbor& seen) {
  return static_cast<double>(seen.identified) / static_cast<double>(seen.visible);
}

TEST(Bearings, PointAtTheNeighborsThatWereThere) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  test::record_swarm(scratch.path(),
                     {.seed = 8, .duration_s = 6.0, .spots = test::SpotSource::kProjection});
  const SeenPairs pairs = watch_all(scratch.path());

  EXPECT_EQ(pairs.size(), 2U);
  for (const auto& [name, seen] : pairs) {
    ASSERT_GT(seen.visible, 300U) << name;
    EXPECT_GT(identified_share(seen), 0.97) << name;
    EXPECT_EQ(seen.wrong, 0U) << name;
    EXPECT_LT(seen.rms_rad(), radians(0.06)) << name;
  }
}

/// The independent recordings, where they are at hand.
class RecordedBearings : public testing::TestWithParam<const char*> {
 protected:
  [[nodiscard]] static fs::path dataset() {
    return fs::path(source_dir()) / "../shared/datasets" / GetParam();
  }
  void SetUp() override {
    if (!fs::exists(dataset())) GTEST_SKIP() << "no recording at " << dataset();
  }
};

TEST_P(RecordedBearings, AreExactAndNeverAnothers) {
  for (const auto& [name, seen] : watch_all(dataset())) {
    EXPECT_LT(seen.rms_rad(), radians(0.06)) << name;
    EXPECT_EQ(seen.wrong, 0U) << name;
  }
}
INSTANTIATE_TEST_SUITE_P(Datasets, RecordedBearings,
                         testing::Values("static", "two-manual", "two-duty", "two-images", "four",
                                         "long-range", "occluded", "aggressive"));

class SteadyView : public RecordedBearings {};

TEST_P(SteadyView, IdentifiesNearlyEverybodyInSight) {
  for (const auto& [name, seen] : watch_all(dataset()))
    EXPECT_GT(identified_share(seen), 0.97) << name;
}
INSTANTIATE_TEST_SUITE_P(Datasets, SteadyView,
                         testing::Values("static", "two-manual", "four", "long-range", "occluded",
                                         "bad-network", "interference"));

/// A bearing far from its neighbor may be a mirror image only: the reflection in the floor.
class MirroringFloor : public RecordedBearings {};

TEST_P(MirroringFloor, IsTheOnlyOtherPlaceWhereRobotsAreSeen) {
  for (const auto& [name, seen] : watch_all(dataset()))
    for (const auto& [measured_W, true_W] : seen.astray_W) {
      EXPECT_LT(measured_W.z(), true_W.z()) << name;
      const double azimuth = std::atan2(measured_W.y(), measured_W.x());
      const double true_azimuth = std::atan2(true_W.y(), true_W.x());
      EXPECT_LT(std::abs(std::remainder(azimuth - true_azimuth, 2.0 * std::numbers::pi)),
                radians(2.0))
          << name;
    }
}
INSTANTIATE_TEST_SUITE_P(Datasets, MirroringFloor, testing::Values("interference"));

}  // namespace
}  // namespace crepes::bearing_test
