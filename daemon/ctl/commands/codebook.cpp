#include "daemon/ctl/setup/codebook.hpp"

#include <unistd.h>

#include <cstdio>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

Result<void> run_codebook(CodebookOptions options, const OutputFile& out) {
  if (::isatty(STDERR_FILENO) == 1) {
    options.search.on_progress = [&](std::size_t found, std::size_t clear_frames) {
      std::fprintf(stderr, "\r%4zu of %zu with %zu clear frames ", found, options.ids,
                   clear_frames);
    };
  }
  const Result<std::string> text = codebook(options);
  if (options.search.on_progress) std::fputs("\r", stderr);
  return text.and_then([&](const std::string& library) {
    return write_output(library, out, options.json ? "{\"swarm\"" : "crepesctl codebook");
  });
}

}  // namespace

void add_codebook(CommandLine& line) {
  auto& options = line.make<CodebookOptions>();
  auto& out = line.make<OutputFile>();
  CLI::App* sub = line.add(
      "codebook",
      "Search blink patterns that a camera can distinguish and write them as swarm.members");
  sub->add_option("--ids", options.ids, "number of patterns")->capture_default_str();
  sub->add_option("--slots", options.rules.slots, "length of a pattern, 8 to 32")
      ->capture_default_str();
  sub->add_option("--distance", options.rules.distance,
                  "slots in which any two patterns differ, however they are shifted")
      ->capture_default_str();
  sub->add_option("--max-dark", options.rules.max_dark, "maximum number of dark slots in a row")
      ->capture_default_str();
  sub->add_option("--seed", options.search.seed, "seed of the search")->capture_default_str();
  add_output_options(sub, out);
  add_json_flag(sub, options.json, "the section swarm, which is also valid in a configuration");
  line.run(sub, [&options, &out] { return run_codebook(options, out); });
}

}  // namespace crepes
