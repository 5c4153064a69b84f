/// The configuration file: reading reports every fault, writing explains every key.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/schema/config.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// One fault of a configuration.
struct ConfigFault {
  std::string file;
  int line = 0;     ///< counted from 1; 0 if the fault has no line
  std::string key;  ///< dotted path, as in `swarm.members[2].id`; empty if the fault has no key
  std::string reason;
};

/// `file:line: key: reason`, in one line whatever the file contains.
[[nodiscard]] std::string to_string(const ConfigFault& fault);

/// A file as read. `config` is valid only when there are no faults, and must not be used otherwise.
struct CheckedConfig {
  Config config;
  std::vector<ConfigFault> faults;    ///< in order of their lines
  std::vector<ConfigFault> warnings;  ///< what can hardly be meant; none if there are faults
};

[[nodiscard]] CheckedConfig check_config_text(const std::string& text, const std::string& file);
[[nodiscard]] CheckedConfig check_config(const std::filesystem::path& path);

/// A valid configuration, or all faults in one message, one a line.
[[nodiscard]] Result<Config> load_config(const std::filesystem::path& path);

/// `config` as a file that `load_config` reads back, with meaning and bounds above each key.
[[nodiscard]] std::string write_config(const Config& config);

/// The text of `config/crepesd.yaml`: all defaults. Two members and a camera make all keys appear.
[[nodiscard]] std::string reference_config();

}  // namespace crepes
