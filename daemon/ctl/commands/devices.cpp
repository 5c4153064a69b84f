#include "daemon/ctl/devices.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_devices(CommandLine& line) {
  auto& options = line.keep<DevicesOptions>();
  CLI::App* sub = line.add(
      "devices", "List cameras and serial devices, and what to write into the configuration");
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return print_result(list_devices(options)); });
}

}  // namespace crepes
