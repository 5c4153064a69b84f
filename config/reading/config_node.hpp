/// A YAML file as a tree in which each value knows its file and line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "config/reading/config_file.hpp"

namespace crepes {

/// Line `line` of a file, counted from 1.
struct Place {
  std::string file;
  int line = 1;
};

/// A text, a list, a mapping, or nothing.
struct ConfigNode {
  /// What a node of the tree is.
  enum class Kind : std::uint8_t { kNothing, kText, kList, kMapping };

  Kind kind = Kind::kNothing;
  std::string text{};
  std::vector<std::string> keys{};  ///< of a mapping, one for each item
  std::vector<ConfigNode> items{};
  Place place{};  ///< in a mapping, that of the key
  bool is_incomplete =
      false;  ///< of a mapping: a fault that explains missing keys has already been reported

  [[nodiscard]] bool is_text() const { return kind == Kind::kText; }
  [[nodiscard]] bool is_list() const { return kind == Kind::kList; }
  [[nodiscard]] bool is_mapping() const { return kind == Kind::kMapping; }

  /// The value of a key of a mapping; null if the key is missing.
  [[nodiscard]] const ConfigNode* find(std::string_view key) const;
  [[nodiscard]] ConfigNode* find(std::string_view key);
  /// Removes a value from a mapping and returns it. The key must exist.
  ConfigNode extract(std::string_view key);
  void add(std::string key, ConfigNode value);
};

/// Parses the single document in `text`. Text that is not YAML, a duplicate key (the first one
/// counts), and a text that is too large or too deep are faults. Without a document the result has
/// no value.
[[nodiscard]] ConfigNode parse_yaml(const std::string& text, const std::string& file,
                                    std::vector<ConfigFault>& faults);

/// Merges `over` into `base`. Mappings merge key by key. Lists whose items all have an `id`, or all
/// have a `name`, merge item by item; new items are appended. Any other value is replaced by
/// `over`.
[[nodiscard]] ConfigNode merged(ConfigNode base, ConfigNode over);

/// The position of the value at a dotted path (`cameras[0].name`), or of the nearest
/// value around it that exists.
[[nodiscard]] const Place& place_of(const ConfigNode& root, std::string_view path);

/// What a node contains, in words: `"abc"`, `a list of 2`.
[[nodiscard]] std::string describe(const ConfigNode& node);

}  // namespace crepes
