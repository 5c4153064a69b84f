#include "daemon/ctl/demo/demo.hpp"

#include <limits>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

constexpr double kFormationFor = 75.0;  ///< s, of which 60 are scored

/// A live table, or a bar where standard output is for one object.
Result<DemoSummary> demo_with_progress(DemoOptions options, bool json) {
  const TerminalProgress progress;
  options.show_table = !json;
  if (json) options.on_progress = progress.sink();
  return demo(options);
}

Result<void> run_demo(const DemoOptions& options, bool json) {
  return demo_with_progress(options, json).and_then([&](const DemoSummary& summary) {
    return print_result(json ? demo_json(summary) : demo_text(summary)).and_then([&] {
      return check_poses(summary);
    });
  });
}

}  // namespace

void add_demo(CommandLine& line) {
  auto& options = line.make<DemoOptions>();
  auto& json = line.make<bool>();
  auto& view = line.make<bool>();
  auto& listen = line.make<std::string>();
  listen = "127.0.0.1:8080";
  CLI::App* sub = line.add(
      "demo", "Start real daemons in a simulated world and compare their poses with its truth");
  CLI::Option* for_s = sub->add_option("--for", options.for_s, "duration in seconds")
                           ->capture_default_str()
                           ->check(CLI::Range(1.0, 600.0));
  add_choice(
      sub, "--scenario", kSimScenarios,
      [&options](SimScenario scenario) { options.scenario = scenario; },
      "what the robots do; default: four");
  sub->add_option("--seed", options.seed, "seed of the world")
      ->capture_default_str()
      ->check(CLI::Range(0, std::numeric_limits<int>::max()));
  sub->add_option("--port", options.port,
                  "UDP port of the first robot's subscription; the others follow")
      ->capture_default_str()
      ->check(CLI::Range(1024, 65000));
  sub->add_option("--run", options.run,
                  "a program that steers the robots of --scenario formation; its options name the "
                  "first daemon's port and that for commands")
      ->check(CLI::ExistingFile);
  sub->add_option("--keep", options.keep,
                  "directory in which configurations, logs and the true paths are kept");
  CLI::Option* view_flag =
      sub->add_flag("--view", view,
                    "serve a page that shows the robots (crepesctl view), and run until "
                    "interrupted unless --for says otherwise");
  sub->add_option("--listen", listen, "where --view serves the page, ADDRESS:PORT")
      ->capture_default_str()
      ->needs(view_flag);
  add_json_flag(sub, json, "one object at the end");
  line.run(sub, [&options, &json, &view, &listen, for_s] {
    if (view) options.view = listen;
    if (for_s->empty() && options.scenario == SimScenario::kFormation)
      options.for_s = kFormationFor;
    if (view && for_s->empty()) options.for_s = std::numeric_limits<double>::infinity();
    return run_demo(options, json);
  });
}

}  // namespace crepes
