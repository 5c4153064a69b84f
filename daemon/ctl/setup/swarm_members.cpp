#include "daemon/ctl/setup/swarm_members.hpp"

#include <algorithm>

#include "config/reading/config_file.hpp"

namespace crepes {

Result<SwarmConfig> load_members(const std::filesystem::path& file) {
  const CheckedConfig checked = check_config(file);
  const auto ours = std::ranges::find_if(checked.faults, [](const ConfigFault& fault) {
    return fault.key.empty() || is_in(fault, &Config::swarm);
  });
  if (ours != checked.faults.end()) return fail(ErrorCode::kConfig, to_string(*ours));
  return checked.config.swarm;
}

}  // namespace crepes
