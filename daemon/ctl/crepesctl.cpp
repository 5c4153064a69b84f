/// The command-line tool of the project. The subcommands are in commands/.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/version.hpp"

namespace crepes {
namespace {

constexpr int kDone = 0;
constexpr int kInputWrong = 1;
constexpr int kUsageWrong = 2;

int run(int argc, char** argv) {
  CLI::App app("crepesctl: watch, record, replay and score relative localization of robot swarms",
               "crepesctl");
  app.formatter(wrapped_help());
  app.set_version_flag("--version", std::string(kVersion));
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done; 1 wrong input, or no answer (the reason is on stderr); 2 wrong usage.");
  CommandLine line(app);
  for (const auto add : kCommands) add(line);
  check_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const bool is_wrong = e.get_exit_code() != 0;
    const auto unknown = is_wrong ? unknown_subcommand(app, {argv + 1, argv + argc}) : std::nullopt;
    if (!unknown) return app.exit(e) == 0 ? kDone : kUsageWrong;
    std::fprintf(stderr, "crepesctl: %s\nRun with --help for more information.\n",
                 unknown->c_str());
    return kUsageWrong;
  }
  const Result<void> done = line.execute();
  if (done) return kDone;
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
