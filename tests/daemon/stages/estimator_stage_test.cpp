#include "daemon/stages/estimator_stage.hpp"

#include <gtest/gtest.h>

#include <chrono>

#include "config/reading/config_file.hpp"
#include "config/schema/estimator_slice.hpp"
#include "daemon/stages/worker.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "tests/support/places.hpp"

namespace crepes::estimator_stage_test {
namespace {

using std::chrono::milliseconds;

TEST(EstimatorStage, LeavesOutSpotsThatWaitedForTooLong) {
  const Config config =
      load_config(source_dir() + "/config/examples/four-simulated/r1.yaml").value();
  const MonotonicClock clock;
  EventQueue events(16, Overflow::kDropOldest);
  Counter late_frames;
  Counter iterations;
  Counter informed;
  LiveSettings<EstimatorSettings> settings(estimator_settings(config));
  const EstimatorSinks sinks{.publish = [](const Outputs&) {},
                             .solve_team = [](const TeamProblem&) {},
                             .publish_status = [&](const EstimatorStatus&) { informed.add(); },
                             .late_frames = late_frames};
  const StageContext context{clock, [](const SensorStatus&) {}, iterations};
  const auto frame = [](Timestamp stamp) {
    return SpotFrame{.stamp = stamp, .camera = 0, .spots = {}};
  };
  const Timestamp now = clock.now();
  events.push(frame(now - milliseconds{700}));
  events.push(frame(now - milliseconds{600}));
  events.push(ImuSample{.stamp = now - milliseconds{500},
                        .gyro_radps = Eigen::Vector3d::Zero(),
                        .accel_mps2 = Eigen::Vector3d(0.0, 0.0, 9.81)});
  events.push(frame(now + milliseconds{500}));  // in time, however slow this machine

  {
    const Worker loop("estimator", [&](const std::stop_token& stop) {
      run_estimator(settings, events, sinks, context, stop);
    });
    while (informed.value() == 0) wait_for(milliseconds{5}, {});
  }

  EXPECT_TRUE(events.empty());
  EXPECT_EQ(late_frames.value(), 2U);
}

}  // namespace
}  // namespace crepes::estimator_stage_test
