#include "daemon/ctl/dataset/record.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/live/live_screen.hpp"
#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

std::string text_of(const RecordSummary& summary) {
  const RecordProgress& progress = summary.progress;
  std::string text =
      fmt::format("{}: {} s, {} rows, {} pictures, {} MB in {}\n", summary.end_reason,
                  fixed(progress.seconds, 1), progress.rows, progress.pictures,
                  fixed(1e-6 * static_cast<double>(progress.bytes), 2), summary.folder.string());
  if (progress.missing > 0)
    text += fmt::format("{} events are missing: the disk was too slow\n", progress.missing);
  if (progress.configurations > 1)
    text += "the daemon was reloaded meanwhile; crepesd.yaml is what it ended with\n";
  if (!summary.warning.empty()) text += summary.warning + "\n";
  return text;
}

std::string json_of(const RecordSummary& summary) {
  const RecordProgress& progress = summary.progress;
  return json_line({{"folder", summary.folder.string()},
                    {"ended", summary.end_reason},
                    {"duration_s", progress.seconds},
                    {"rows", progress.rows},
                    {"pictures", progress.pictures},
                    {"bytes", progress.bytes},
                    {"missing", progress.missing},
                    {"configurations", progress.configurations},
                    {"warning", summary.warning}});
}

Result<void> run_record(RecordOptions options, bool json) {
  if (::isatty(STDERR_FILENO) == 1) {
    options.on_progress = [](const RecordProgress& progress) {
      std::fprintf(stderr, "\r%6.1f s  %8.2f MB  %llu rows ", progress.seconds,
                   1e-6 * static_cast<double>(progress.bytes),
                   static_cast<unsigned long long>(progress.rows));
    };
  }
  const StopSignals until_restored;
  const KeyReader keys;
  options.is_enough = [&keys] { return keys.next() == 'q'; };
  const Result<RecordSummary> summary = record(options);
  if (options.on_progress) std::fputs("\r", stderr);
  if (!summary) return tl::unexpected(summary.error());
  return print_result(json ? json_of(*summary) : text_of(*summary));
}

}  // namespace

void add_record(CommandLine& line) {
  auto& options = line.make<RecordOptions>();
  auto& json = line.make<bool>();
  CLI::App* sub =
      line.add("record", "Record the measurements of a running daemon as a data set for replay");
  sub->add_option("DIR", options.dir,
                  "directory for swarm.yaml and the robot's folder, without a data set")
      ->required();
  sub->add_flag("--images", options.pictures, "also record pictures, as many as time permits");
  sub->add_option_function<double>(
         "--duration", [&options](double seconds) { options.duration_s = seconds; },
         "stop after this many seconds; default: stop with q or Ctrl-C")
      ->check(CLI::Range(0.1, 1e6));
  sub->add_option_function<double>(
         "--max-size",
         [&options](double megabytes) {
           options.max_bytes = static_cast<std::uint64_t>(1e6 * megabytes);
         },
         "stop at this many MB; default: 1074, a gibibyte")
      ->check(CLI::Range(0.1, 1e7));
  sub->add_option("--socket", options.socket, "the daemon's recording.socket")
      ->capture_default_str();
  add_json_flag(sub, json, "one object at the end");
  line.run(sub, [&options, &json] { return run_record(options, json); });
}

}  // namespace crepes
