#include "daemon/ctl/live/full_status.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "daemon/ctl/live/status.hpp"
#include "net/subscription/subscription_json.hpp"
#include "tests/daemon/ctl/live/served_status.hpp"

namespace crepes::full_status_test {
namespace {

TEST(FullStatus, HasTheCountsOfEverySensorHoweverManyThereAre) {
  SystemStatus status;
  status.self = RobotId{1};
  for (const char* name : {"cam0", "cam1", "cam2", "cam3"}) {
    status.sensors.push_back({name, 100.0, true, "", {{}, {{"frames", 1000}}}});
    status.sensors.push_back({name + std::string(" spots"),
                              100.0,
                              true,
                              "",
                              {{},
                               {{"delay_p50_us", 2000},
                                {"delay_p99_us", 3000},
                                {"threshold", 30},
                                {"background", 4},
                                {"brightest", 255},
                                {"faintest", 200},
                                {"hot_pixels", 12},
                                {"faint", 5000},
                                {"auto_exposure_us", 400},
                                {"longest_exposure_us", 500},
                                {"spots", 3}}}});
  }
  status.sensors.push_back({"imu", 100.0, true, "", {{}, {{"samples", 500}}}});
  ASSERT_EQ(status_json(status, StatusPart::kSensors).find("counts"), std::string::npos);
  const ServedStatus daemon(status);

  const Result<FullStatus> full = request_full_status(daemon.address());

  ASSERT_TRUE(full) << full.error().message;
  ASSERT_EQ(full->message.sensors.size(), 9U);
  for (const client::Status::Sensor& sensor : full->message.sensors)
    EXPECT_FALSE(sensor.counts.empty()) << sensor.name;
  EXPECT_EQ(full->message.sensors[7].name, "cam3 spots");
  EXPECT_EQ(full->message.sensors[7].counts.at("delay_p99_us"), 3000U);
}

TEST(Status, NamesARefusedReloadAndWhatWaitsForARestart) {
  SystemStatus state;
  state.self = RobotId{1};
  state.config.fault = "r1.yaml:20: uwb.noise: unknown key\nr1.yaml:21: uwb.bias: unknown key";
  state.config.restart = {"cameras", "imu"};
  const ServedStatus daemon(state);

  const Result<std::string> text = status({.daemon = daemon.address()});

  ASSERT_TRUE(text) << text.error().message;
  for (const char* part :
       {"reload was refused: r1.yaml:20: uwb.noise: unknown key; r1.yaml:21:\n  uwb.bias: unknown",
        "`systemctl restart crepesd`: cameras, imu"})
    EXPECT_NE(text->find(part), std::string::npos) << part << "\n" << *text;
}

TEST(Status, SaysNothingOfAConfigurationThatIsInUse) {
  SystemStatus state;
  state.self = RobotId{1};
  const ServedStatus daemon(state);

  const Result<std::string> text = status({.daemon = daemon.address()});

  ASSERT_TRUE(text) << text.error().message;
  EXPECT_EQ(text->find("configuration"), std::string::npos) << *text;
}

}  // namespace
}  // namespace crepes::full_status_test
