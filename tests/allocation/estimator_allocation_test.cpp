// What the estimator takes from the heap once it knows its neighbor.
#include <gtest/gtest.h>

#include <map>

#include "estimator/swarm/neighbor.hpp"
#include "tests/allocation/allocation_counter.hpp"
#include "tests/support/estimator_pair.hpp"

namespace crepes::estimator_allocation_test {
namespace {

using namespace std::chrono_literals;
using test::allocations;
using test::EstimatorPair;
using test::SimulatedPair;

TEST(FilterAllocation, NoneWhilePropagatingAndCorrecting) {
  SimulatedPair pair(1);
  pair.sample_imus(Timestamp{2s});
  const Timestamp start{1s};
  const auto raw = std::get<RawPose>(compute_raw_pose(pair.sighting(start)));

  const std::size_t before = allocations();
  NeighborFilter filter(start, raw, pair.process_noise(), pair.priors());
  int fused = 0;
  for (Timestamp t = start; t <= Timestamp{1900ms}; t += 7ms) {
    filter.advance_to(t, pair.imu_B, pair.imu_N);
    for (const Fusion& fusion :
         {filter.fuse_bearing(pair.bearing(t), pair.mounting_N.led, 20.0),
          filter.fuse_peer_bearing(pair.peer_bearing(t), pair.mounting_B.led, 20.0),
          filter.fuse_range(pair.range(t), pair.mounting_B.antenna, pair.mounting_N.antenna, 20.0)})
      fused += fusion.verdict == Verdict::kFused ? 1 : 0;
  }

  EXPECT_EQ(allocations() - before, 0U);
  EXPECT_GT(fused, 300);
}

/// Most allocations of a single step, by the event's index in the variant, after `warm_up`.
std::map<std::size_t, std::size_t> most_allocations(Duration warm_up) {
  std::vector<Event> events;
  // What goes to the team's filter is an output, too.
  EstimatorPair pair(1, [](EstimatorSettings& settings) { settings.solves_graph = false; });
  pair.log_to(events);
  pair.run_for(warm_up + 3s);

  Estimator estimator(pair.settings());
  std::map<std::size_t, std::size_t> most;
  const Timestamp warm = pair.own_time(warm_up);
  for (const Event& event : events) {
    const std::size_t before = allocations();
    const Outputs outputs = estimator.step(event);
    const std::size_t taken = allocations() - before;
    if (stamp_of(event) >= warm) most[event.index()] = std::max(most[event.index()], taken);
  }
  EXPECT_TRUE(estimator.status().neighbors.at(0).pose);
  return most;
}

TEST(EstimatorAllocation, EndsAfterTheFirstSecondsButForOutputs) {
  const auto most = most_allocations(4s);

  const auto of = [&](const Event& event) { return most.at(event.index()); };
  EXPECT_EQ(of(ImuSample{}), 0U);
  EXPECT_EQ(of(UwbRange{}), 0U);
  EXPECT_EQ(of(ReceivedReport{}), 0U);
  EXPECT_LE(of(SpotFrame{}), 2U);  // the bearings it gives, and their sorting
  EXPECT_LE(of(Tick{}), 8U);       // poses, estimates, and a report's lists
}

}  // namespace
}  // namespace crepes::estimator_allocation_test
