#include "daemon/ctl/live/status.hpp"

#include <gtest/gtest.h>

#include <sstream>
#include <string>

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

TEST(Status, WrapsFaultsOfSensorsBelowTheTable) {
  client::Status status;
  const std::string message =
      "/dev/serial/by-id/usb-FTDI_FT230X_Basic_UART_D30A1XYZ-if00-port0: no frames with a good "
      "checksum: is the baud rate right, and is it the module that is meant?";
  status.sensors = {{"uwb", 0.0, false, message, {}, {}}, {"imu", 100.0, true, "", {}, {}}};
  status.faults = {
      "its camera is turned by 3.10 +- 0.20 deg against its calibration; calibrate it "
      "again, and measure where it is mounted"};
  for (const char* name : {"held_clock_unknown", "poses_sent", "received", "received_bytes",
                           "refused_seal_missing", "requests", "sent", "sent_bytes"})
    status.network[name] = 100'000;

  const std::string text = status_text(
      status, {.fault = "/etc/crepes/crepesd.d/50-tuning.yaml:12: vision.bearing_sigma: "
                        "unknown key; did you mean bearing_sigma_px?",
               .restart = ""});

  EXPECT_NE(text.find("uwb: /dev/serial"), std::string::npos) << text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
}

}  // namespace
}  // namespace crepes::status_test
