/// A YAML file as a value that knows of each part where it stands.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config_file.hpp"

namespace crepes {

/// Line `line` of a file, counted from 1.
struct Place {
  std::string file;
  int line = 1;
};

/// A text, a list, a mapping, or nothing.
struct ConfigNode {
  enum class Kind : std::uint8_t { kNothing, kText, kList, kMapping };

  Kind kind = Kind::kNothing;
  std::string text{};
  std::vector<std::string> keys{};  ///< of a mapping, one for each item
  std::vector<ConfigNode> items{};
  Place place{};               ///< in a mapping, of the key
  bool is_incomplete = false;  ///< of a mapping: why a key may be missing has been told already

  [[nodiscard]] bool is_text() const { return kind == Kind::kText; }
  [[nodiscard]] bool is_list() const { return kind == Kind::kList; }
  [[nodiscard]] bool is_mapping() const { return kind == Kind::kMapping; }

  /// The value of a key of a mapping; null where there is none.
  [[nodiscard]] const ConfigNode* find(std::string_view key) const;
  [[nodiscard]] ConfigNode* find(std::string_view key);
  /// A value of a mapping, taken out of it. The key must be there.
  ConfigNode take(std::string_view key);
  void add(std::string key, ConfigNode value);
};

/// The one document in `text`. What is no YAML, a key that is given twice (the first counts), and a
/// text that is too large or too deep are faults; without a document the result is nothing.
[[nodiscard]] ConfigNode parse_yaml(const std::string& text, const std::string& file,
                                    std::vector<ConfigFault>& faults);

/// `over` laid over `base`: mappings merge key by key, lists whose items all have an `id` or all
/// have a `name` item by item, new ones at the end. Of anything else `over` is what counts.
[[nodiscard]] ConfigNode merged(ConfigNode base, ConfigNode over);

/// Where the value at a dotted path (`cameras[0].name`) stands, or the nearest thing around it that
/// is there.
[[nodiscard]] const Place& place_of(const ConfigNode& root, std::string_view path);

/// What a node holds, in words: `the text "abc"`, `a list of 2`.
[[nodiscard]] std::string describe(const ConfigNode& node);

}  // namespace crepes
