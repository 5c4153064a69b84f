/// The files that a configuration is made of, as one tree.
#pragma once

#include <filesystem>
#include <vector>

#include "daemon/config_node.hpp"

namespace crepes {

/// crepesd.yaml, over it the files crepesd.d/*.yaml in the order of their names, and in the place
/// of `swarm.members_file` and of every `calibration` what those files say. Relative names start at
/// the folder of the file that has them.
[[nodiscard]] ConfigNode gather_config(const std::filesystem::path& path,
                                       std::vector<ConfigFault>& faults);
/// The same for one text instead of files and fragments.
[[nodiscard]] ConfigNode gather_config_text(const std::string& text, const std::string& file,
                                            std::vector<ConfigFault>& faults);

}  // namespace crepes
