/// Merges the files of a configuration into one tree.
#pragma once

#include <filesystem>
#include <vector>

#include "config/reading/config_node.hpp"

namespace crepes {

/// Reads crepesd.yaml and merges the files crepesd.d/*.yaml over it, in the order of their names.
/// Replaces `swarm.members_file` and every `calibration` by the content of those files. Relative
/// names start at the folder of the file that contains them.
[[nodiscard]] ConfigNode load_config_tree(const std::filesystem::path& path,
                                          std::vector<ConfigFault>& faults);
/// The same for one text instead of files and fragments.
[[nodiscard]] ConfigNode parse_config_tree(const std::string& text, const std::string& file,
                                           std::vector<ConfigFault>& faults);
/// Warnings of files beside crepesd.d/*.yaml that look like fragments.
[[nodiscard]] std::vector<ConfigFault> ignored_fragments(const std::filesystem::path& path);

}  // namespace crepes
