#include "daemon/ctl/setup/led.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

using LedCommand = Result<std::string> (*)(const LedOptions&);

CLI::App* add_led_command(CommandLine& line, CLI::App* led, const std::string& name,
                          const std::string& help, LedCommand run_led, LedOptions& options) {
  CLI::App* sub = led->add_subcommand(name, help);
  sub->fallthrough();  // --port may stand behind it, too
  add_json_flag(sub, options.json);
  line.run(sub, [&options, run_led] { return print_result(run_led(options)); });
  return sub;
}

}  // namespace

void add_led(CommandLine& line) {
  auto& options = line.make<LedOptions>();
  CLI::App* led = line.add("led", "Program the board that blinks a robot's ID");
  led->add_option("--port", options.port, "its serial line")->required();
  led->require_subcommand(1);
  CLI::App* set = add_led_command(
      line, led, "set", "Store a robot's pattern on the board and read it back", led_set, options);
  set->add_option("--id", options.id, "id of the robot")->required()->check(CLI::Range(1, 65534));
  set->add_option("--library", options.library, "a configuration or library with swarm.members")
      ->required();
  set->add_option("--brightness", options.brightness,
                  "in percent: one value for all LEDs, or one for each of six")
      ->expected(1, LED_COUNT)
      ->capture_default_str()
      ->check(CLI::Range(0, 100));
  add_led_command(line, led, "get", "Show the board's settings and status", led_get, options);
  add_led_command(line, led, "test", "Steady light for a while", led_test, options)
      ->add_option("--for", options.test_s, "seconds; 0 ends it")
      ->capture_default_str()
      ->check(CLI::Range(0.0, int{LED_TEST_MAX_MS} / 1e3));
}

}  // namespace crepes
