#include "daemon/ctl/live/sources.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace crepes::sources_test {
namespace {

client::Status status_with(std::uint64_t fused, std::uint64_t gated, std::uint64_t reports) {
  client::Status::Neighbor neighbor;
  neighbor.peer = 2;
  neighbor.name = "r2";
  neighbor.measurements["bearing"] = {{"fused", fused}, {"gated", gated}};
  neighbor.ages_s = {{"bearing", 0.11}, {"imu", 0.02}};
  neighbor.reports = {.received = reports, .lost = 7, .restarts = 0, .age_s = 0.015};
  client::Status status;
  status.neighbors = {neighbor};
  return status;
}

Source find(const std::vector<Source>& sources, const std::string& kind) {
  const auto found = std::ranges::find(sources, kind, &Source::kind);
  EXPECT_NE(found, sources.end()) << kind;
  return found == sources.end() ? Source{} : *found;
}

TEST(Sources, CountRatesBetweenTwoLooksWhateverBecameOfTheMeasurements) {
  const auto sources = sources_of(status_with(100, 10, 500), status_with(280, 30, 600), 2.0);

  EXPECT_EQ(find(sources, "bearing").rate_hz, 100.0);
  EXPECT_EQ(find(sources, "bearing").used, 280U);
  EXPECT_EQ(find(sources, "bearing").refused.at("gated"), 30U);
  EXPECT_EQ(find(sources, "bearing").age_s, 0.11);
  EXPECT_EQ(find(sources, "reports").rate_hz, 50.0);
  EXPECT_EQ(find(sources, "reports").refused.at("lost"), 7U);
  EXPECT_EQ(find(sources, "imu").age_s, 0.02);
}

TEST(Sources, NameWhatNeverCame) {
  const auto sources = sources_of(status_with(1, 0, 1), status_with(1, 0, 1), 1.0);

  EXPECT_EQ(find(sources, "peer_range").rate_hz, 0.0);
  EXPECT_TRUE(std::isnan(find(sources, "peer_range").age_s));
}

TEST(Sources, BeginAnewWithADaemonThatDid) {
  const auto sources = sources_of(status_with(900, 0, 900), status_with(5, 0, 5), 1.0);

  EXPECT_EQ(find(sources, "bearing").rate_hz, 0.0);
}

}  // namespace
}  // namespace crepes::sources_test
