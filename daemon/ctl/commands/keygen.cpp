#include <nlohmann/json.hpp>

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"
#include "daemon/mesh_key.hpp"

namespace crepes {

void add_keygen(CommandLine& line) {
  auto& file = line.keep<std::filesystem::path>();
  auto& json = line.keep<bool>();
  CLI::App* sub =
      line.add("keygen",
               "Make the swarm's key: 32 random bytes, to be copied to every robot and "
               "named there as net.key_file. Datagrams between robots are sealed with it");
  sub->add_option("FILE", file, "a new file, readable by its owner alone")->required();
  add_json_flag(sub, json);
  line.run(sub, [&file, &json] {
    return write_mesh_key(file).and_then([&](const MeshKey& key) {
      const std::string name = fingerprint(key);
      return print_result(json ? json_line({{"file", file.string()}, {"fingerprint", name}})
                               : file.string() + ": key " + name + "\n");
    });
  });
}

}  // namespace crepes
