/// The tool around the daemon: replays, scores, watches, shows. Exit codes: 0 done, 1 the input is
/// wrong (what and where on stderr), 2 wrong usage.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "daemon/ctl/codebook.hpp"
#include "daemon/ctl/demo.hpp"
#include "daemon/ctl/devices.hpp"
#include "daemon/ctl/evaluate.hpp"
#include "daemon/ctl/import_calibration.hpp"
#include "daemon/ctl/led.hpp"
#include "daemon/ctl/live_screen.hpp"
#include "daemon/ctl/plot.hpp"
#include "daemon/ctl/setup_witmotion.hpp"
#include "daemon/ctl/spots.hpp"
#include "daemon/ctl/swarm_replay.hpp"
#include "daemon/ctl/text_table.hpp"
#include "daemon/ctl/watch.hpp"

namespace crepes {
namespace {

constexpr int kInputWrong = 1;
constexpr int kUsageWrong = 2;

/// What was asked for; runs after all options have been read.
using Command = std::function<Result<void>()>;

/// An option that takes one of the names of an enumeration.
template <class Enum, std::size_t N, class Set>
void add_choice(CLI::App* app, const std::string& flag, const std::array<Choice<Enum>, N>& choices,
                const Set& set, const std::string& help) {
  std::vector<std::string> names;
  names.reserve(N);
  for (const Choice<Enum>& choice : choices) names.emplace_back(choice.name);
  app->add_option_function<std::string>(
         flag,
         [choices, set](const std::string& name) {
           for (const Choice<Enum>& choice : choices)
             if (choice.name == name) set(choice.value);
         },
         help)
      ->check(CLI::IsMember(names));
}

Result<void> run_replay(ReplayOptions options) {
  if (::isatty(STDERR_FILENO) == 1)
    options.on_progress = [](double share) { std::fprintf(stderr, "\r%3.0f %% ", 100.0 * share); };
  const Result<ReplaySummary> summary = replay_swarm(options);
  if (options.on_progress) std::fputs("\r", stderr);
  if (!summary) return tl::unexpected(summary.error());
  for (const std::string& fault : summary->faults.list())
    std::fprintf(stderr, "refused: %s\n", fault.c_str());
  print(std::to_string(summary->robots) + " robots, " + fixed(summary->duration_s, 1) + " s, " +
        std::to_string(summary->poses) + " poses in " + options.out_dir.string() + "\n");
  return {};
}

void add_replay(CLI::App& app, ReplayOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "replay", "Run all robots of a recorded swarm on virtual time and write their poses");
  sub->add_option("SWARM_DIR", options.swarm_dir, "the data set")->required();
  sub->add_option("--out", options.out_dir,
                  "directory for <observer>/<neighbor>.csv, .tum and report.json")
      ->required();
  add_choice(
      sub, "--profile", kProfiles, [&options](Profile profile) { options.profile = profile; },
      "filter, instead of what the configuration files say");
  sub->add_flag("--no-graph{false},--graph{true}", options.graph, "no pose graph");
  sub->add_option_function<std::uint64_t>(
      "--seed", [&options](std::uint64_t seed) { options.seed = seed; },
      "of the simulated network, instead of swarm.yaml's");
  sub->add_flag(
      "--debug-innovations", options.records,
      "also <neighbor>.innovations.csv and .calibration.csv: every measurement's residual, "
      "sigma, NIS and verdict, and the biases that the filter believes in");
  sub->callback([&] { command = [&options] { return run_replay(options); }; });
}

void add_evaluate(CLI::App& app, EvaluateOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "evaluate",
      "Compare the poses of a replay with ground truth: errors without alignment "
      "(ATE), availability, consistency, clocks");
  sub->add_option("DIR", options.results, "what replay wrote")->required();
  sub->add_option("--truth", options.swarm, "the data set, with its truth/")->required();
  sub->add_option("--after", options.after_s, "seconds at the start that are not scored")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--against", options.against,
                  "other results of the same data set; both are scored over common rows");
  sub->add_flag("--json", options.json, "JSON instead of a table");
  sub->callback([&] {
    command = [&options] { return evaluate(options).map([](const auto& text) { print(text); }); };
  });
}

void add_plot(CLI::App& app, PlotOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "plot", "Draw a replay as one HTML page: errors, innovations, biases, modes, latency");
  sub->add_option("DIR", options.results, "what replay wrote")->required();
  sub->add_option("--truth", options.swarm, "the data set, with its truth/");
  sub->add_option("--out", options.out, "the page; plot.html in DIR if left out");
  sub->callback([&] {
    command = [&options] {
      return plot(options).map([](const auto& page) { print(page.string() + "\n"); });
    };
  });
}

void add_address(CLI::App* sub, WatchOptions& options) {
  sub->add_option("--address", options.address, "where the daemon serves poses")
      ->capture_default_str();
  sub->add_option("--port", options.port, "its UDP port")
      ->capture_default_str()
      ->check(CLI::Range(1, 65535));
  sub->add_flag("--json", options.json, "the daemon's own JSON, one object a line");
}

void add_watch(CLI::App& app, WatchOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "watch", "A live table of the neighbors' poses, and why there is none where there is none");
  add_address(sub, options);
  sub->add_option_function<double>(
         "--for", [&options](double seconds) { options.for_s = seconds; },
         "stop after so many seconds")
      ->check(CLI::Range(0.1, 1e6));
  sub->add_flag("--once", options.once, "one table, then stop");
  sub->callback([&] { command = [&options] { return watch(options); }; });
}

void add_status(CLI::App& app, WatchOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand("status", "One look at a daemon: sensors, neighbors, clocks");
  add_address(sub, options);
  sub->callback([&] { command = [&options] { return print_status(options); }; });
}

void add_demo(CLI::App& app, DemoOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "demo", "Start real daemons in a simulated world and compare their poses with its truth");
  sub->add_option("--for", options.for_s, "seconds")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 600.0));
  add_choice(
      sub, "--scenario", kSimScenarios,
      [&options](SimScenario scenario) { options.scenario = scenario; },
      "what the robots do; four if left out");
  sub->add_option("--seed", options.seed, "of the world")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  sub->add_option("--port", options.port, "the first robot's subscription; the others follow")
      ->capture_default_str()
      ->check(CLI::Range(1024, 65000));
  sub->add_option("--keep", options.keep, "directory in which configurations and logs stay");
  sub->callback([&] { command = [&options] { return demo(options); }; });
}

/// To a file, or to standard output where none is named.
Result<void> deliver(const std::string& text, const std::string& file) {
  if (file.empty()) {
    print(text);
    return {};
  }
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) return fail(ErrorCode::kIo, file + ": cannot be written");
  return {};
}

Result<void> run_codebook(CodebookOptions options, const std::string& out) {
  if (::isatty(STDERR_FILENO) == 1) {
    options.search.on_progress = [&](std::size_t found, std::size_t clear_frames) {
      std::fprintf(stderr, "\r%4zu of %zu with %zu clear frames ", found, options.ids,
                   clear_frames);
    };
  }
  const Result<std::string> text = codebook(options);
  if (options.search.on_progress) std::fputs("\r", stderr);
  return text.and_then([&](const std::string& library) { return deliver(library, out); });
}

void add_codebook(CLI::App& app, CodebookOptions& options, std::string& out, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "codebook",
      "Search blink patterns that a camera tells apart and write them as swarm.members");
  sub->add_option("--ids", options.ids, "how many")->capture_default_str();
  sub->add_option("--slots", options.rules.slots, "length of a pattern, 8 to 32")
      ->capture_default_str();
  sub->add_option("--distance", options.rules.distance,
                  "slots in which any two patterns differ, however they are shifted")
      ->capture_default_str();
  sub->add_option("--max-dark", options.rules.max_dark, "dark slots in a row")
      ->capture_default_str();
  sub->add_option("--seed", options.search.seed, "of the search")->capture_default_str();
  sub->add_option("--out", out, "file; left out: standard output");
  sub->callback([&] { command = [&] { return run_codebook(options, out); }; });
}

void add_import_calibration(CLI::App& app, std::vector<std::filesystem::path>& files,
                            std::string& out, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "import-calibration",
      "Read calibrations of Kalibr (camchain-imucam.yaml, imu.yaml) or Basalt (calibration.json) "
      "and write the sections cameras and imu of a configuration");
  sub->add_option("FILE", files, "calibration files; together one robot's")->required();
  sub->add_option("--out", out, "file; left out: standard output");
  sub->callback([&] {
    command = [&] {
      return import_calibration(files).and_then(
          [&](const std::string& text) { return deliver(text, out); });
    };
  });
}

Result<void> run_spots(SpotsOptions options) {
  const bool shows_progress = ::isatty(STDERR_FILENO) == 1;
  options.on_text = [](const std::string& text) { print(text); };
  options.on_fault = [](const std::string& fault) {
    std::fprintf(stderr, "refused: %s\n", fault.c_str());
  };
  if (shows_progress)
    options.on_progress = [](double share) { std::fprintf(stderr, "\r%3.0f %%\r", 100.0 * share); };
  return inspect_spots(options).map([](const SpotsSummary&) {});
}

void add_spots(CLI::App& app, SpotsOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "spots",
      "Show what the detector and the tracker find in recorded pictures: for setting up exposure "
      "and threshold");
  sub->add_option("IMAGE_OR_FOLDER", options.source,
                  "a picture, a data set's cam0, or any folder of pictures")
      ->required();
  sub->add_option("--config", options.config, "crepesd.yaml of the robot that took them")
      ->required();
  sub->add_option("--out", options.out, "directory for PNGs with spots, robots and their trails");
  sub->add_option("--every", options.every, "draw one picture in so many")
      ->capture_default_str()
      ->check(CLI::Range(1, 1000000));
  sub->add_option("--camera", options.camera,
                  "its name in the configuration; left out: that of cam0, cam1, ... in the path");
  sub->add_flag("--json", options.json, "one JSON object a picture, and one for all");
  sub->callback([&] { command = [&options] { return run_spots(options); }; });
}

void add_setup_witmotion(CLI::App& app, WitMotionSetup& setup, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "setup-witmotion",
      "Have a WitMotion IMU send acceleration and rate alone, fast enough, and keep it so");
  sub->add_option("--port", setup.port, "its serial line")->required();
  sub->add_option("--baud", setup.baud, "its rate now")->capture_default_str();
  sub->add_option("--rate", setup.rate_hz, "samples a second: 10, 20, 50, 100 or 200")
      ->capture_default_str();
  sub->callback([&] {
    command = [&] {
      return set_up_witmotion(setup).map([](const std::string& text) { print(text); });
    };
  });
}

void add_devices(CLI::App& app, DevicesOptions& options, Command& command) {
  CLI::App* sub = app.add_subcommand(
      "devices", "List cameras and serial devices, and what to write into the configuration");
  sub->add_flag("--json", options.json, "JSON instead of text");
  sub->callback([&] {
    command = [&] { return list_devices(options).map([](const auto& text) { print(text); }); };
  });
}

using LedCommand = Result<std::string> (*)(const LedOptions&);

CLI::App* add_led_command(CLI::App* led, const std::string& name, const std::string& help,
                          LedCommand run_led, const LedOptions& options, Command& command) {
  CLI::App* sub = led->add_subcommand(name, help);
  sub->callback([&options, &command, run_led] {
    command = [&options, run_led] {
      return run_led(options).map([](const auto& text) { print(text); });
    };
  });
  return sub;
}

void add_led(CLI::App& app, LedOptions& options, Command& command) {
  CLI::App* led = app.add_subcommand("led", "Program the board that blinks a robot's ID");
  led->add_option("--port", options.port, "its serial line")->required();
  led->require_subcommand(1);
  CLI::App* set = add_led_command(led, "set", "Keep an ID's pattern on the board and read it back",
                                  led_set, options, command);
  set->add_option("--id", options.id, "the robot's")->required()->check(CLI::Range(1, 65534));
  set->add_option("--library", options.library, "a configuration or library with swarm.members")
      ->required();
  set->add_option("--brightness", options.brightness, "in percent: of all LEDs, or of each of six")
      ->expected(1, LED_COUNT)
      ->capture_default_str()
      ->check(CLI::Range(0, 100));
  add_led_command(led, "get", "Show what the board holds", led_get, options, command);
  add_led_command(led, "test", "Steady light for a while", led_test, options, command)
      ->add_option("--for", options.test_s, "seconds; 0 ends it")
      ->capture_default_str()
      ->check(CLI::Range(0.0, int{LED_TEST_MAX_MS} / 1e3));
}

int run(int argc, char** argv) {
  CLI::App app("crepesctl: replay, score and watch relative localization of robot swarms");
  app.require_subcommand(1);
  ReplayOptions replay_options;
  EvaluateOptions evaluate_options;
  PlotOptions plot_options;
  SpotsOptions spots_options;
  WatchOptions watch_options;
  DemoOptions demo_options;
  CodebookOptions codebook_options;
  LedOptions led_options;
  WitMotionSetup witmotion_setup;
  DevicesOptions devices_options;
  std::vector<std::filesystem::path> calibration_files;
  std::string out;
  Command command;
  add_replay(app, replay_options, command);
  add_evaluate(app, evaluate_options, command);
  add_plot(app, plot_options, command);
  add_watch(app, watch_options, command);
  add_status(app, watch_options, command);
  add_demo(app, demo_options, command);
  add_codebook(app, codebook_options, out, command);
  add_import_calibration(app, calibration_files, out, command);
  add_spots(app, spots_options, command);
  add_led(app, led_options, command);
  add_setup_witmotion(app, witmotion_setup, command);
  add_devices(app, devices_options, command);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : kUsageWrong;
  }
  const Result<void> done = command();
  if (done) return 0;
  std::fprintf(stderr, "crepesctl: %s\n", done.error().message.c_str());
  return done.error().code == ErrorCode::kUsage ? kUsageWrong : kInputWrong;
}

}  // namespace
}  // namespace crepes

int main(int argc, char** argv) {
  try {
    return crepes::run(argc, argv);
  } catch (const std::exception& e) {  // out of memory; nothing else gets here
    std::fprintf(stderr, "crepesctl: %s\n", e.what());
    return 1;
  }
}
