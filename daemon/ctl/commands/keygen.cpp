#include "daemon/ctl/keygen.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_keygen(CommandLine& line) {
  auto& file = line.keep<std::filesystem::path>();
  CLI::App* sub = line.add(
      "keygen",
      "Make the swarm's mesh key: 32 random bytes, to be copied to every robot. Nothing uses it "
      "yet: datagrams between robots are not sealed in this version");
  sub->add_option("FILE", file, "a new file, readable by its owner alone")->required();
  line.run(sub, [&file] { return write_mesh_key(file); });
}

}  // namespace crepes
