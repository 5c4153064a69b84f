#include "daemon/ctl/setup/init.hpp"

#include <unistd.h>

#include <cstdio>
#include <iostream>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

constexpr int kNumbersOfAnArm = 3;

/// Asks only somebody who sits at a terminal. Faults of the result end as `--check-config` does.
Result<void> run_init(const InitOptions& options, bool asks) {
  const bool is_terminal = ::isatty(STDIN_FILENO) == 1 && ::isatty(STDERR_FILENO) == 1;
  Questions questions(asks && is_terminal ? &std::cin : nullptr, std::cerr);
  const Result<InitReport> report = init(options, questions);
  if (!report) return tl::unexpected(report.error());
  if (auto printed = print_result(report->text); !printed) return printed;
  for (const ConfigFault& warning : report->warnings)
    std::fprintf(stderr, "still to do: %s\n", to_string(warning).c_str());
  return report->faults.empty() ? Result<void>()
                                : fail(ErrorCode::kConfig, to_string(report->faults));
}

void add_camera_options(CLI::App* sub, InitOptions& options) {
  CLI::Option* camera =
      sub->add_option("--camera", options.camera_driver,
                      "its driver, instead of the one that is found")
          ->check(CLI::IsMember({"none", "aravis", "v4l2", "libcamera", "mindvision"}));
  sub->add_option("--device", options.camera_device, "its device, with --camera")->needs(camera);
  sub->add_option("--resolution", options.resolution, "width and height [px]; default: 1280 1024")
      ->expected(2)
      ->check(CLI::Range(16, 2048));
  sub->add_option("--rate", options.rate_hz, "frames a second; default: 200")
      ->check(CLI::Range(10.0, 1000.0));
  sub->add_option("--fov", options.fov_deg, "the lens's rough field of view [deg]; default: 185")
      ->check(CLI::Range(60.0, 220.0));
  sub->add_option("--look", options.look, "where the camera looks; default: forward")
      ->check(CLI::IsMember({"forward", "backward", "left", "right", "up", "down"}));
}

}  // namespace

void add_init(CommandLine& line) {
  auto& options = line.make<InitOptions>();
  auto& yes = line.make<bool>();
  CLI::App* sub = line.add(
      "init",
      "Write the configuration of a new robot from what is connected, with a pattern for every "
      "robot; print what to measure. Asks at a terminal for what no option says");
  sub->add_option("--dir", options.dir, "where to write")->capture_default_str();
  sub->add_option("--id", options.id,
                  "id of this robot; without a swarm.yaml, robots have the ids 1 to 64")
      ->check(CLI::Range(1, 65534));
  sub->add_option("--robots", options.robots,
                  "how many robots the swarm has; if omitted, a swarm.yaml that is there is kept")
      ->check(CLI::Range(2, 64));
  add_camera_options(sub, options);
  sub->add_option("--imu-port", options.imu_port, "serial port of the inertial sensor");
  sub->add_option("--uwb-port", options.uwb_port, "serial port of the UWB module");
  sub->add_option("--led", options.p_body_led,
                  "center of the LED ring from the inertial sensor: x y z [m], forward, left, up")
      ->expected(kNumbersOfAnArm)
      ->check(CLI::Range(-5.0, 5.0));
  sub->add_option("--uwb", options.p_body_uwb, "UWB antenna from the inertial sensor: x y z [m]")
      ->expected(kNumbersOfAnArm)
      ->check(CLI::Range(-5.0, 5.0));
  sub->add_option("--interface", options.interface, "network interface of the mesh; default: bat0");
  sub->add_flag("--force", options.force, "replace files; the old ones are kept as NAME~");
  sub->add_flag("--yes", yes, "ask nothing: options and proposals alone");
  sub->add_flag_callback(
      "--no-search", [&options] { options.search_devices = false; },
      "do not look for connected devices, which listens to every serial port");
  add_json_flag(sub, options.json);
  line.run(sub, [&options, &yes] { return run_init(options, !yes); });
}

}  // namespace crepes
