#include "config/reading/config_node.hpp"

#include <fmt/core.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <sstream>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

/// Far more than any configuration needs. An alias can expand a few lines to gigabytes, or contain
/// itself.
constexpr std::size_t kMaxNodes = 30000;
constexpr std::size_t kMaxDepth = 32;

class IgnoringHandler final : public YAML::EventHandler {
 public:
  using Mark = YAML::Mark;
  using Style = YAML::EmitterStyle::value;
  void OnDocumentStart(const Mark& /*mark*/) override {}
  void OnDocumentEnd() override {}
  void OnNull(const Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnAlias(const Mark& /*mark*/, YAML::anchor_t /*anchor*/) override {}
  void OnScalar(const Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                const std::string& /*value*/) override {}
  void OnSequenceStart(const Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                       Style /*style*/) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const Mark& /*mark*/, const std::string& /*tag*/, YAML::anchor_t /*anchor*/,
                  Style /*style*/) override {}
  void OnMapEnd() override {}
};

/// 0, 1, or 2 for more. YAML::LoadAll never ends on some texts that are not YAML.
int documents_in(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  IgnoringHandler nothing;
  int count = 0;
  while (count < 2 && parser.HandleNextDocument(nothing)) ++count;
  return count;
}

/// yaml-cpp counts lines from 0.
int line_of(const YAML::Mark& mark) { return mark.is_null() ? 1 : mark.line + 1; }

/// Copies a tree of yaml-cpp.
class Reader {
 public:
  Reader(std::string file, std::vector<ConfigFault>& faults)
      : file_(std::move(file)), faults_(faults) {}

  ConfigNode read(const YAML::Node& from, const std::string& path, std::size_t depth) {
    ConfigNode node;
    node.place = {file_, line_of(from.Mark())};
    if (++count_ > kMaxNodes || depth > kMaxDepth) {
      if (!is_too_much_) fault(node.place.line, path, "too large or nested too deep");
      is_too_much_ = true;
    } else if (from.IsScalar()) {
      node.kind = ConfigNode::Kind::kText;
      node.text = from.Scalar();
    } else if (from.IsSequence()) {
      node.kind = ConfigNode::Kind::kList;
      for (const YAML::Node& item : from) {
        if (is_too_much_) break;
        const std::string item_path = fmt::format("{}[{}]", path, node.items.size());
        node.items.push_back(read(item, item_path, depth + 1));
      }
    } else if (from.IsMap()) {
      read_entries(from, path, depth, node);
    }
    return node;
  }

  void fault(int line, const std::string& key, std::string reason) {
    faults_.push_back({file_, line, key, std::move(reason)});
  }

 private:
  void read_entries(const YAML::Node& from, const std::string& path, std::size_t depth,
                    ConfigNode& node) {
    node.kind = ConfigNode::Kind::kMapping;
    std::map<std::string, int, std::less<>> lines;
    for (const auto& entry : from) {
      if (is_too_much_) break;
      const int line = line_of(entry.first.Mark());
      if (!entry.first.IsScalar()) {
        fault(line, path, "expected a key, found a list or a mapping");
        continue;
      }
      const std::string& key = entry.first.Scalar();
      std::string key_path = path;
      if (!key_path.empty()) key_path += '.';
      key_path += key;
      const auto [first, is_new] = lines.emplace(key, line);
      if (!is_new) {
        fault(first->second, key_path, fmt::format("is given again in line {}", line));
        continue;
      }
      ConfigNode value = read(entry.second, key_path, depth + 1);
      value.place.line = line;
      node.add(key, std::move(value));
    }
  }

  std::string file_;
  std::vector<ConfigFault>& faults_;
  std::size_t count_ = 0;
  bool is_too_much_ = false;
};

/// The key that identifies the items of both lists; empty if not all items have one.
std::string_view naming_key(const ConfigNode& a, const ConfigNode& b) {
  for (const std::string_view key : {"id", "name"}) {
    const auto has_key = [key](const ConfigNode& item) {
      const ConfigNode* value = item.is_mapping() ? item.find(key) : nullptr;
      return value != nullptr && value->is_text();
    };
    if (std::ranges::all_of(a.items, has_key) && std::ranges::all_of(b.items, has_key)) return key;
  }
  return {};
}

ConfigNode merged_lists(ConfigNode base, ConfigNode over) {
  const std::string_view key = naming_key(base, over);
  if (key.empty() || over.items.empty()) return over;
  for (ConfigNode& item : over.items) {
    const std::string& name = item.find(key)->text;
    const auto same = std::ranges::find_if(
        base.items, [&](const ConfigNode& other) { return other.find(key)->text == name; });
    if (same == base.items.end()) {
      base.items.push_back(std::move(item));
    } else {
      *same = merged(std::move(*same), std::move(item));
    }
  }
  return base;
}

/// Follows the step of a path that begins at `at`: `key`, `.key` or `[2]`. Moves `at` behind it.
const ConfigNode* step(const ConfigNode& node, std::string_view path, std::size_t& at) {
  const bool is_index = path[at] == '[';
  const std::size_t begin = path[at] == '.' || is_index ? at + 1 : at;
  const std::size_t end = std::min(path.find_first_of(is_index ? "]" : ".[", begin), path.size());
  const std::string_view name = path.substr(begin, end - begin);
  at = is_index ? std::min(end + 1, path.size()) : end;
  if (!is_index) return node.find(name);
  std::size_t index = node.items.size();
  std::from_chars(name.data(), name.data() + name.size(), index);
  return node.is_list() && index < node.items.size() ? &node.items[index] : nullptr;
}

}  // namespace

const ConfigNode* ConfigNode::find(std::string_view key) const {
  const auto found = std::ranges::find(keys, key);
  return found == keys.end() ? nullptr : &items[static_cast<std::size_t>(found - keys.begin())];
}

ConfigNode* ConfigNode::find(std::string_view key) {
  return const_cast<ConfigNode*>(  // NOLINT(cppcoreguidelines-pro-type-const-cast): *this is not
      std::as_const(*this).find(key));
}

ConfigNode ConfigNode::extract(std::string_view key) {
  const auto found = std::ranges::find(keys, key);
  CREPES_EXPECT(found != keys.end(), "the key is there");
  const auto item = items.begin() + (found - keys.begin());
  ConfigNode value = std::move(*item);
  items.erase(item);
  keys.erase(found);
  return value;
}

void ConfigNode::add(std::string key, ConfigNode value) {
  keys.push_back(std::move(key));
  items.push_back(std::move(value));
}

ConfigNode parse_yaml(const std::string& text, const std::string& file,
                      std::vector<ConfigFault>& faults) {
  Reader reader(file, faults);
  try {
    const int documents = documents_in(text);
    if (documents == 1) {
      ConfigNode root = reader.read(YAML::Load(text), "", 0);
      root.place.line = 1;
      return root;
    }
    if (documents > 1) reader.fault(1, "", "holds more than one YAML document");
  } catch (const YAML::Exception& e) {
    reader.fault(line_of(e.mark), "", "not YAML: " + e.msg);
  }
  ConfigNode nothing;
  nothing.place.file = file;
  return nothing;
}

ConfigNode merged(ConfigNode base, ConfigNode over) {
  if (base.is_list() && over.is_list()) return merged_lists(std::move(base), std::move(over));
  if (!base.is_mapping() || !over.is_mapping()) return over;
  for (std::size_t i = 0; i < over.keys.size(); ++i) {
    if (ConfigNode* const below = base.find(over.keys[i])) {
      *below = merged(std::move(*below), std::move(over.items[i]));
    } else {
      base.add(std::move(over.keys[i]), std::move(over.items[i]));
    }
  }
  return base;
}

const Place& place_of(const ConfigNode& root, std::string_view path) {
  const ConfigNode* nearest = &root;
  for (std::size_t at = 0; at < path.size();) {
    const ConfigNode* const next = step(*nearest, path, at);
    if (next == nullptr) break;
    nearest = next;
  }
  return nearest->place;
}

std::string describe(const ConfigNode& node) {
  constexpr std::size_t kShown = 40;
  if (node.is_text()) {
    return fmt::format("\"{}{}\"", node.text.substr(0, kShown),
                       node.text.size() > kShown ? "..." : "");
  }
  if (node.is_list()) return fmt::format("a list of {}", node.items.size());
  return node.is_mapping() ? "a mapping" : "nothing";
}

}  // namespace crepes
