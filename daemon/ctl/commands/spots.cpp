#include "daemon/ctl/setup/spots.hpp"

#include <cstdio>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

Result<void> run_spots(SpotsOptions options) {
  const TerminalProgress progress;
  Result<void> printed;
  options.on_text = [&](const std::string& text) {
    progress.clear();
    if (printed) printed = print_result(text);
  };
  options.on_fault = [&](const std::string& fault) {
    progress.clear();
    std::fprintf(stderr, "skipped: %s\n", fault.c_str());
  };
  options.on_progress = progress.sink();
  return inspect_spots(options).and_then([&](const SpotsSummary&) { return printed; });
}

}  // namespace

void add_spots(CommandLine& line) {
  auto& options = line.make<SpotsOptions>();
  CLI::App* sub = line.add(
      "spots",
      "Show what the detector and the tracker find in a recording, to set exposure and threshold, "
      "and write the bearings");
  sub->add_option(
         "ROBOT_DIR", options.source,
         "a recorded robot (cam0 and imu0), its cam0, any folder of pictures, or a picture")
      ->required();
  sub->add_option("--config", options.config, "crepesd.yaml of the robot that took them")
      ->required();
  sub->add_option("--out", options.out,
                  "directory for bearings.csv and PNGs with spots, robots and their trails");
  sub->add_option("--every", options.every, "draw every n-th picture")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  sub->add_option(
      "--camera", options.camera,
      "camera name in the configuration; default: the one of cam0, cam1, ... in the path");
  add_json_flag(sub, options.json, "one object per picture, and one summary");
  line.run(sub, [&options] { return run_spots(options); });
}

}  // namespace crepes
