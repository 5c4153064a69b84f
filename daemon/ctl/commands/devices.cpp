#include "daemon/ctl/setup/devices.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_devices(CommandLine& line) {
  auto& options = line.make<DevicesOptions>();
  CLI::App* sub =
      line.add("devices", "List cameras and serial devices with their lines for the configuration");
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return print_result(list_devices(options)); });
}

}  // namespace crepes
