#include "daemon/ctl/score/evaluate.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {
namespace {

Result<std::string> evaluate_with_progress(EvaluateOptions options) {
  const TerminalProgress progress;
  options.on_progress = progress.sink();
  return evaluate(options);
}

}  // namespace

void add_evaluate(CommandLine& line) {
  auto& options = line.make<EvaluateOptions>();
  CLI::App* sub =
      line.add("evaluate",
               "Compare the poses of a replay with ground truth: errors without alignment "
               "(ATE), availability, consistency, clocks");
  sub->add_option("DIR", options.results, "output directory of replay")->required();
  sub->add_option("--truth", options.swarm, "the data set, with its truth/")->required();
  sub->add_option("--after", options.after_s, "seconds at the start that are not scored")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1e6));
  sub->add_option("--against", options.against,
                  "other results of the same data set; both are scored over their common rows");
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return print_result(evaluate_with_progress(options)); });
}

}  // namespace crepes
