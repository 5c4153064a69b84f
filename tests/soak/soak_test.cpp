#include "tests/soak/soak.hpp"

#include <gtest/gtest.h>

namespace crepes::soak_test {
namespace {

using namespace std::chrono_literals;

TEST(Soak, TenSecondsOfMishapsLeaveNothingBehind) {
  const SoakReport report = run_soak({.duration = 10s, .warm_up = 3s, .give_up = 10s, .seed = 1});

  SCOPED_TRACE(to_string(report));
  EXPECT_EQ(report.stuck, "");
  EXPECT_EQ(report.wrong, "");
  EXPECT_EQ(report.descriptors_after, report.descriptors_before);
  EXPECT_GT(report.samples, 100U);
  EXPECT_GT(report.ranges, 50U);
  EXPECT_GT(report.pictures_returned, 0U);
}

}  // namespace
}  // namespace crepes::soak_test
