#include "daemon/ctl/score/plot.hpp"

#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"

namespace crepes {

void add_plot(CommandLine& line) {
  auto& options = line.make<PlotOptions>();
  auto& json = line.make<bool>();
  CLI::App* sub = line.add(
      "plot", "Draw a replay as one HTML page: errors, innovations, biases, modes, latency");
  sub->add_option("DIR", options.results, "output directory of replay")->required();
  sub->add_option("--truth", options.swarm, "the data set, with its truth/");
  sub->add_option("--out", options.out, "the page; default: plot.html in DIR");
  sub->add_flag("--force", options.force, "replace a file that is no page");
  add_json_flag(sub, json);
  line.run(sub, [&options, &json] {
    return plot(options).and_then([&](const std::filesystem::path& page) {
      return print_result(json ? json_line({{"page", page.string()}}) : page.string() + "\n");
    });
  });
}

}  // namespace crepes
