#include "daemon/ctl/live/exposure.hpp"

#include <limits>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_exposure(CommandLine& line) {
  auto& options = line.make<ExposureOptions>();
  CLI::App* sub = line.add(
      "exposure",
      "Set exposure and gain of a running camera while showing the brightest and the faintest "
      "light. Without values: shows them, and at a terminal changes them by keys");
  add_daemon_options(sub, options.daemon);
  sub->add_option("--config", options.config,
                  "the daemon's configuration; what is set goes to 90-exposure.yaml in the folder "
                  "of its fragments")
      ->capture_default_str();
  sub->add_option("--camera", options.camera, "its name; default: the first");
  sub->add_option("--exposure-us", options.exposure_us, "exposure time [us]")
      ->check(CLI::Range(1.0, 100000.0));
  sub->add_option("--gain", options.gain, "in the device's own unit")
      ->check(CLI::Range(0.0, 1000.0));
  sub->add_option("--pid", options.pid,
                  "process of the daemon, to reload it; default: systemctl reload crepesd")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()));
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return exposure(options); });
}

}  // namespace crepes
