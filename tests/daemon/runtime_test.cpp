#include "daemon/runtime.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "daemon/service/logging.hpp"
#include "drivers/base/monotonic_clock.hpp"
#include "tests/support/live_daemon.hpp"

namespace crepes::runtime_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(Runtime, ReportsWhatIsWrongWithDevicesThatAreNotThere) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock machine;
  Config config = without_devices(free_port());
  config.uwb.device.port = "/dev/nothing-here";
  const Runtime runtime(config, machine);
  Client client(config);

  EXPECT_TRUE(client.await_status([](const Json& status) {
    return mentions(sensor_of(status, "uwb"), "/dev/nothing-here") &&
           mentions(sensor_of(status, "imu"), "set imu.port");
  }));
}

TEST(Runtime, OpensNoRealDeviceInASimulation) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock machine;
  Config config = pair_config(1, free_port());
  config.uwb.device.port = "/dev/nothing-here";
  config.swarm.members[1].uwb_id = 300;  // which the simulated module cannot send
  const Runtime runtime(config, machine);
  Client client(config);

  EXPECT_TRUE(client.await_status(
      [](const Json& status) { return mentions(sensor_of(status, "uwb"), "set uwb.port"); }));
}

TEST(Runtime, StopsWithinASecondAndAllLoopsTurnUntilThen) {
  const LogSession log(LogLevel::kError);
  const MonotonicClock machine;
  Timestamp asked;
  {
    const Runtime runtime(pair_config(2, free_port()), machine);
    Watchdog watchdog(runtime.heartbeats());
    std::vector<std::string> stuck{"not yet looked"};
    // A look is honest when there was time to turn; a laden machine may need more than one.
    for (int i = 0; i < 10 && !stuck.empty(); ++i) {
      wait_for(milliseconds{500}, std::stop_token{});
      stuck = watchdog.check();
    }
    EXPECT_TRUE(stuck.empty()) << stuck.front();
    asked = machine.now();
  }

  EXPECT_LT(machine.now() - asked, seconds{1});
}

TEST(Watchdog, NamesTheLoopThatMadeNoProgress) {
  Counter living;
  Counter dead;
  Watchdog watchdog({{"living", &living}, {"dead", &dead}});
  living.add();
  dead.add();
  EXPECT_TRUE(watchdog.check().empty());

  living.add();

  EXPECT_EQ(watchdog.check(), std::vector<std::string>{"dead"});
}

}  // namespace
}  // namespace crepes::runtime_test
