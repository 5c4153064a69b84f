#include "daemon/ctl/convert/convert.hpp"

#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"

namespace crepes {
namespace {

Result<ConvertSummary> convert_with_progress(ConvertOptions options) {
  const TerminalProgress progress;
  options.on_progress = progress.sink();
  return convert_to_mcap(options);
}

std::string text_of_conversion(const ConvertSummary& summary, const std::string& out) {
  const std::string left_out =
      summary.before_start == 0
          ? ""
          : fmt::format(", {} left out before the recording's start", summary.before_start);
  return fmt::format("{} messages of {} topics in {}{}\n", summary.messages, summary.topics, out,
                     left_out);
}

Result<void> run_convert(ConvertOptions options, bool json) {
  if (options.out.empty()) options.out = options.source / "swarm.mcap";
  const Result<ConvertSummary> summary = convert_with_progress(options);
  if (!summary) return tl::unexpected(summary.error());
  print_skipped(summary->faults);
  const std::string out = options.out.string();
  return print_result(json ? json_line({{"out", out},
                                        {"topics", summary->topics},
                                        {"messages", summary->messages},
                                        {"before_start", summary->before_start},
                                        {"refused", summary->faults.counts()}})
                           : text_of_conversion(*summary, out));
}

}  // namespace

void add_convert(CommandLine& line) {
  auto& options = line.make<ConvertOptions>();
  auto& json = line.make<bool>();
  auto& format = line.make<std::string>();
  CLI::App* sub = line.add(
      "convert", "Write a recording or a replay as an MCAP file, for Foxglove and similar tools");
  sub->add_option("SWARM_OR_REPLAY", options.source,
                  "a recorded swarm, or the output directory of replay")
      ->required();
  sub->add_option("--to", format, "the format")->required()->check(CLI::IsMember({"mcap"}));
  sub->add_option("--truth", options.swarm,
                  "the data set of a replay, with the robots' clocks and, if it has one, truth/");
  sub->add_option("--out", options.out, "the file; default: swarm.mcap in SWARM_OR_REPLAY");
  sub->add_flag("--force", options.force, "replace a file that is no MCAP file");
  add_json_flag(sub, json);
  line.run(sub, [&options, &json] { return run_convert(options, json); });
}

}  // namespace crepes
