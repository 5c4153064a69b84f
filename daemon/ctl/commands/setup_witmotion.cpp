#include "daemon/ctl/setup/setup_witmotion.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {

namespace {

Result<void> run_setup(const WitMotionSetup& setup, bool json) {
  return set_up_witmotion(setup).and_then([&](double measured_hz) {
    if (json) {
      return print_result(json_line(
          {{"port", setup.port}, {"update_rate", setup.rate_hz}, {"measured_hz", measured_hz}}));
    }
    return print_result(fmt::format("{}: {} samples a second; set imu.update_rate to {}.0\n",
                                    setup.port, fixed(measured_hz, 0), setup.rate_hz));
  });
}

}  // namespace

void add_setup_witmotion(CommandLine& line) {
  auto& setup = line.make<WitMotionSetup>();
  auto& json = line.make<bool>();
  CLI::App* sub = line.add(
      "setup-witmotion",
      "Configure a WitMotion IMU to send only acceleration and angular rate, at the given rate");
  sub->add_option("--port", setup.port, "its serial line")->required();
  sub->add_option("--baud", setup.baud, "its current baud rate")->capture_default_str();
  sub->add_option("--rate", setup.rate_hz, "samples per second: 10, 20, 50, 100 or 200")
      ->capture_default_str();
  add_json_flag(sub, json);
  line.run(sub, [&setup, &json] { return run_setup(setup, json); });
}

}  // namespace crepes
