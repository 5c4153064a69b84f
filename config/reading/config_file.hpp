/// The configuration file: reading reports every fault, writing explains every key.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "config/schema/config.hpp"
#include "config/schema/section_name.hpp"
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
/// A line for each fault; no line break at the end.
[[nodiscard]] std::string to_string(const std::vector<ConfigFault>& faults);

/// Whether the fault is in a section of the configuration, as in `is_in(fault, &Config::swarm)`.
[[nodiscard]] bool is_in_section(const ConfigFault& fault, std::string_view section);
template <class Section>
[[nodiscard]] bool is_in(const ConfigFault& fault, Section Config::*section) {
  return is_in_section(fault, section_name(section));
}

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
