#include <fmt/core.h>

#include <nlohmann/json.hpp>

#include "config/keys/mesh_key.hpp"
#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"

namespace crepes {

void add_keygen(CommandLine& line) {
  auto& file = line.make<std::filesystem::path>();
  auto& json = line.make<bool>();
  CLI::App* sub = line.add(
      "keygen",
      "Create the swarm's key: 32 random bytes. Copy it to every robot and name it there as "
      "net.key_file. It seals the datagrams between the robots");
  sub->add_option("FILE", file, "a new file, readable only by its owner")->required();
  add_json_flag(sub, json);
  line.run(sub, [&file, &json] {
    return write_mesh_key(file).and_then([&](const MeshKey& key) {
      const std::string name = fingerprint(key);
      return print_result(json ? json_line({{"file", file.string()}, {"fingerprint", name}})
                               : fmt::format("{}: key {}\n", file.string(), name));
    });
  });
}

}  // namespace crepes
