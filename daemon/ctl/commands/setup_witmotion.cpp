#include "daemon/ctl/setup_witmotion.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_setup_witmotion(CommandLine& line) {
  auto& setup = line.keep<WitMotionSetup>();
  CLI::App* sub = line.add(
      "setup-witmotion",
      "Have a WitMotion IMU send acceleration and rate alone, fast enough, and keep it so");
  sub->add_option("--port", setup.port, "its serial line")->required();
  sub->add_option("--baud", setup.baud, "its rate now")->capture_default_str();
  sub->add_option("--rate", setup.rate_hz, "samples a second: 10, 20, 50, 100 or 200")
      ->capture_default_str();
  line.run(sub, [&setup] { return print_result(set_up_witmotion(setup)); });
}

}  // namespace crepes
