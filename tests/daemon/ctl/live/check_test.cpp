#include "daemon/ctl/live/check.hpp"

#include <gtest/gtest.h>

#include <sstream>

#include "tests/daemon/ctl/live/served_status.hpp"

namespace crepes::check_test {
namespace {

TEST(CheckCommand, WrapsWhatItAdvises) {
  SystemStatus status;
  status.self = RobotId{1};
  NeighborStatus neighbor;
  neighbor.neighbor = RobotId{2};
  neighbor.name = "r2";
  status.estimator.neighbors = {neighbor};
  const ServedStatus daemon(status);
  CheckOptions options;
  options.daemon = daemon.address();
  options.duration_s = 1.0;

  const auto report = check(options);

  ASSERT_TRUE(report) << report.error().message;
  EXPECT_NE(report->text.find("r2: never heard\n         -> Check the mesh"), std::string::npos)
      << report->text;
  std::istringstream lines(report->text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
}

}  // namespace
}  // namespace crepes::check_test
