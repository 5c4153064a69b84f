/// The configuration file: read with every fault named, written with every key explained.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One thing that is wrong with a configuration.
struct ConfigFault {
  std::string file;
  int line = 0;     ///< counted from 1; 0 when no line is to blame
  std::string key;  ///< dotted path, as in `swarm.members[2].id`; empty when no key is to blame
  std::string reason;
};

/// `file:line: key: reason`
[[nodiscard]] std::string to_string(const ConfigFault& fault);

/// A file as read: `config` is valid when there are no faults, and must not be used otherwise.
struct CheckedConfig {
  Config config;
  std::vector<ConfigFault> faults;  ///< in order of their lines
};

[[nodiscard]] CheckedConfig check_config_text(const std::string& text, const std::string& file);
[[nodiscard]] CheckedConfig check_config(const std::filesystem::path& path);

/// A valid configuration, or all faults in one message, one a line.
[[nodiscard]] Result<Config> load_config(const std::filesystem::path& path);

/// `config` as a file that `load_config` reads back, every key with its meaning and bounds.
[[nodiscard]] std::string write_config(const Config& config);

/// The text of `config/crepesd.yaml`: all defaults, with two members and a camera to have all keys.
[[nodiscard]] std::string reference_config();

}  // namespace crepes
