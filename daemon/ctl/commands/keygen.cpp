#include <fmt/core.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"
#include "daemon/ctl/json_line.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

struct KeygenOptions {
  fs::path swarm_key;
  fs::path robot_key;  ///< empty: only the swarm's
  bool json = false;
};

/// The swarm's key. With a robot's key to make, an existing one is read.
Result<MeshKey> swarm_key(const KeygenOptions& options) {
  std::error_code error;
  const bool is_there = fs::exists(options.swarm_key, error);
  return is_there && !options.robot_key.empty() ? read_mesh_key(options.swarm_key)
                                                : write_mesh_key(options.swarm_key);
}

Result<void> keygen(const KeygenOptions& options) {
  const Result<MeshKey> swarm = swarm_key(options);
  if (!swarm) return tl::unexpected(swarm.error());
  const std::string file = options.swarm_key.string();
  nlohmann::ordered_json json{{"file", file}, {"fingerprint", fingerprint(*swarm)}};
  std::string text = fmt::format("{}: key {}\n", file, fingerprint(*swarm));
  if (!options.robot_key.empty()) {
    const Result<RobotKey> robot = write_robot_key(options.robot_key);
    if (!robot) return tl::unexpected(robot.error());
    const std::string known = to_text(public_key_of(*robot));
    json["robot_file"] = options.robot_key.string();
    json["public_key"] = known;
    text += fmt::format(
        "{}: this robot's own key; for its line in swarm.members of all robots:\n"
        "  public_key: \"{}\"\n",
        options.robot_key.string(), known);
  }
  return print_result(options.json ? json_line(json) : text);
}

}  // namespace

void add_keygen(CommandLine& line) {
  auto& options = line.make<KeygenOptions>();
  CLI::App* sub = line.add(
      "keygen",
      "Create the swarm's key, with which datagrams between the robots are sealed, and this "
      "robot's own key, with which it signs them. Copy the swarm's key to every robot, and no "
      "robot's own. Name them there as net.key_file and net.robot_key_file");
  sub->add_option("FILE", options.swarm_key,
                  "the swarm's key: a new file, readable only by its owner; an existing key is "
                  "kept if ROBOT_FILE is given")
      ->required();
  sub->add_option("ROBOT_FILE", options.robot_key,
                  "this robot's own key: a new file, readable only by its owner");
  add_json_flag(sub, options.json);
  line.run(sub, [&options] { return keygen(options); });
}

}  // namespace crepes
