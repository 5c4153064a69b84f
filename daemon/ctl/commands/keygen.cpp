#include "daemon/ctl/keygen.hpp"

#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"

namespace crepes {

void add_keygen(CommandLine& line) {
  auto& file = line.keep<std::filesystem::path>();
  auto& json = line.keep<bool>();
  CLI::App* sub = line.add(
      "keygen",
      "Make the swarm's mesh key: 32 random bytes, to be copied to every robot. Nothing uses it "
      "yet: datagrams between robots are not sealed in this version");
  sub->add_option("FILE", file, "a new file, readable by its owner alone")->required();
  add_json_flag(sub, json);
  line.run(sub, [&file, &json] {
    return write_mesh_key(file).and_then([&]() -> Result<void> {
      if (!json) return {};
      return print_result(json_line({{"file", file.string()}}));
    });
  });
}

}  // namespace crepes
