#include "daemon/ctl/live/check.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_check(CommandLine& line) {
  auto& options = line.make<CheckOptions>();
  CLI::App* sub = line.add(
      "check",
      "Watch a running robot for a few seconds and say what is right, what is wrong and what to "
      "do: sensors, rates, clocks, exposure, board, mesh, calibration");
  add_daemon_options(sub, options.daemon);
  CLI::Option* config =
      sub->add_option("--config", options.config,
                      "the daemon's configuration: also compare the rates with what it says");
  sub->add_option("--for", options.duration_s, "seconds to watch")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 60.0));
  sub->add_option("--led", options.led_port,
                  "serial port of this robot's LED board: compare its pattern with --config's")
      ->needs(config);
  CLI::Option* walk = sub->add_option("--walk", options.walk,
                                      "a neighbor, by name or id: say step by step where to carry "
                                      "it, and whether its pose follows")
                          ->check(robot_name_or_id());
  sub->add_option("--distance", options.distance_m,
                  "with --walk: from robot to robot in the first step, by tape [m]")
      ->needs(walk)
      ->check(CLI::Range(0.1, 100.0));
  add_json_flag(sub, options.json);
  line.run(sub, [&options]() -> Result<void> {
    const Result<CheckReport> report = check(options);
    if (!report) return tl::unexpected(report.error());
    if (auto printed = print_result(report->text); !printed) return printed;
    return report->is_good ? Result<void>() : fail(ErrorCode::kIo, "check: faults were found");
  });
}

}  // namespace crepes
