#include "daemon/ctl/plot.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/live_screen.hpp"

namespace crepes {

void add_plot(CommandLine& line) {
  auto& options = line.keep<PlotOptions>();
  CLI::App* sub = line.add(
      "plot", "Draw a replay as one HTML page: errors, innovations, biases, modes, latency");
  sub->add_option("DIR", options.results, "what replay wrote")->required();
  sub->add_option("--truth", options.swarm, "the data set, with its truth/");
  sub->add_option("--out", options.out, "the page; plot.html in DIR if left out");
  line.run(sub, [&options] {
    return plot(options).map([](const auto& page) { print(page.string() + "\n"); });
  });
}

}  // namespace crepes
