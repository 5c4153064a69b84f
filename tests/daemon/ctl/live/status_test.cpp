#include "daemon/ctl/live/status.hpp"

#include <gtest/gtest.h>

namespace crepes::status_test {
namespace {

/// A camera that sees nothing, with these counts of its spots.
client::Status in_the_dark(client::Status::Totals counts) {
  client::Status status;
  status.sensors = {{"cam0", 200.0, true, "", {}, {{"frames", 1000}}},
                    {"cam0 spots", 200.0, true, "", {}, std::move(counts)}};
  return status;
}

TEST(Status, AdvisesOnTheLightOfABlackPicture) {
  const client::Status status = in_the_dark({{"threshold", 16}, {"delay_p50_us", 300}});

  EXPECT_NE(status_text(status, {}).find("cam0 spots: put another robot's board in view"),
            std::string::npos);
}

TEST(Status, AdvisesNothingOnTheLightOfACameraThatIsSilent) {
  client::Status status = in_the_dark({{"hot", 12}});
  status.sensors[1].rate_hz = 0.0;

  EXPECT_EQ(status_text(status, {}).find("cam0 spots: put"), std::string::npos);
}

}  // namespace
}  // namespace crepes::status_test
