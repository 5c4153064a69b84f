#include "config/reading/config_sources.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "config/calibration/imported_calibration.hpp"
#include "config/keys/mesh_key.hpp"
#include "config/keys/robot_key.hpp"
#include "drivers/base/text_file.hpp"
#include "estimator/core/result.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

using ConfigFaults = std::vector<ConfigFault>;

/// Parses a file. If it cannot be read, adds a fault and returns a node without a value.
ConfigNode parse_file(const fs::path& path, ConfigFaults& faults) {
  const Result<std::string> text = read_text(path, kMaxConfigBytes);
  if (text) return parse_yaml(*text, path.string(), faults);
  faults.push_back({path.string(), 0, "", text.error().message});
  return {.place = {path.string(), 1}};
}

/// The files beside `path` in its folder of fragments that end in `extension`, in their order.
std::vector<fs::path> fragments_of(const fs::path& path, std::string_view extension,
                                   ConfigFaults& faults) {
  const fs::path folder = path.parent_path() / (path.stem().string() + ".d");
  std::vector<fs::path> files;
  std::error_code error;
  if (!fs::exists(folder, error)) return files;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->path().extension() == extension &&
        !entry->path().filename().string().starts_with('.'))
      files.push_back(entry->path());  // a hidden one is an editor's
  }
  if (error) faults.push_back({folder.string(), 0, "", error.message()});
  std::ranges::sort(files);
  return files;
}

void add_fault(const Place& place, const std::string& key, std::string reason,
               ConfigFaults& faults) {
  faults.push_back({place.file, place.line, key, std::move(reason)});
}

/// Removes a text value from its mapping and returns it.
std::optional<ConfigNode> extract_text(ConfigNode* mapping, const std::string& path,
                                       std::string_view key, ConfigFaults& faults) {
  if (mapping == nullptr || mapping->find(key) == nullptr) return std::nullopt;
  ConfigNode value = mapping->extract(key);
  if (value.is_text() && !value.text.empty()) return value;
  add_fault(value.place, fmt::format("{}.{}", path, key),
            "expected a name, found " + describe(value), faults);
  mapping->is_incomplete = true;
  return std::nullopt;
}

/// Adds the keys of `below` that the mapping does not have itself. `below` has no value if its
/// faults have already been reported.
void add_missing_keys(ConfigNode& mapping, ConfigNode below) {
  const Place place = mapping.place;
  const bool is_incomplete = mapping.is_incomplete || !below.is_mapping();
  if (below.is_mapping()) mapping = merged(std::move(below), std::move(mapping));
  mapping.place = place;
  mapping.is_incomplete = is_incomplete;
}

/// Parses the file that `reference` names. Returns a mapping, or adds faults.
ConfigNode parse_named(const ConfigNode& reference, const std::string& path, ConfigFaults& faults) {
  const fs::path file = fs::path(reference.place.file).parent_path() / reference.text;
  const auto refuse = [&](const std::string& reason) {
    add_fault(reference.place, path, file.string() + reason, faults);
    return ConfigNode{};
  };
  std::error_code error;
  if (!fs::is_regular_file(file, error)) {
    const bool is_hidden = error && error != std::errc::no_such_file_or_directory;
    return refuse(is_hidden ? ": " + error.message() : " is not a file");
  }
  const std::size_t faults_before = faults.size();
  ConfigNode root = parse_file(file, faults);
  if (faults.size() > faults_before) return {};
  return root.is_mapping() ? root : refuse(" holds no keys");
}

/// The section `swarm` of a members file, which must contain nothing else.
ConfigNode shared_swarm(const ConfigNode& reference, const std::string& path,
                        ConfigFaults& faults) {
  ConfigNode root = parse_named(reference, path, faults);
  if (!root.is_mapping()) return {};
  const std::size_t faults_before = faults.size();
  for (std::size_t i = 0; i < root.keys.size(); ++i) {
    if (root.keys[i] != "swarm")
      add_fault(root.items[i].place, root.keys[i], "a members file holds swarm alone", faults);
  }
  const ConfigNode* const swarm = root.find("swarm");
  if (swarm == nullptr || !swarm->is_mapping()) {
    add_fault(root.place, "swarm", "is missing from this members file", faults);
  } else if (const ConfigNode* const again = swarm->find("members_file")) {
    add_fault(again->place, path, "a members file names no other", faults);
  }
  return faults.size() > faults_before ? ConfigNode{} : root.extract("swarm");
}

/// Members beside a members file change members of that file and add none.
void check_overrides(const ConfigNode& here, const ConfigNode* shared, const std::string& file,
                     ConfigFaults& faults) {
  const auto id_of = [](const ConfigNode& member) {
    const ConfigNode* const id = member.is_mapping() ? member.find("id") : nullptr;
    return id == nullptr ? std::string() : id->text;
  };
  for (const ConfigNode& member : here.items) {
    const bool is_known =
        shared != nullptr && std::ranges::count(shared->items, id_of(member), id_of) > 0;
    if (!is_known) {
      add_fault(member.place, "swarm.members",
                fmt::format("{} has no member {}", file, id_of(member)), faults);
    }
  }
}

void add_members(ConfigNode& root, ConfigFaults& faults) {
  ConfigNode* const swarm = root.find("swarm");
  const auto reference = extract_text(swarm, "swarm", "members_file", faults);
  if (!reference) return;
  ConfigNode shared = shared_swarm(*reference, "swarm.members_file", faults);
  const ConfigNode* const here = swarm->find("members");
  if (here != nullptr && shared.is_mapping())
    check_overrides(*here, shared.find("members"), reference->text, faults);
  add_missing_keys(*swarm, std::move(shared));
}

void move_to(const Place& place, ConfigNode& node) {
  node.place = place;
  for (ConfigNode& item : node.items) move_to(place, item);
}

/// A calibration as the sections `cameras` and `imu`. All values have the position of their camera.
/// If the file is not a calibration, adds faults and returns a node without a value.
ConfigNode parse_calibration(const ConfigNode& reference, const std::string& path,
                             std::string_view only_camera, ConfigFaults& faults) {
  const ConfigNode root = parse_named(reference, path, faults);
  if (!root.is_mapping()) return {};
  const std::size_t faults_before = faults.size();
  const ImportedCalibration calibration = read_calibration(root, faults, only_camera);
  if (faults.size() > faults_before) return {};
  ConfigNode sections = parse_yaml(calibration_text(calibration), root.place.file, faults);
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i)
    move_to(place_of(root, calibration.cameras[i].name), sections.find("cameras")->items[i]);
  if (calibration.imu) move_to(place_of(root, "imu0"), *sections.find("imu"));
  return sections;
}

/// The keys of the camera `name` in a calibration, of which the other cameras may be anything.
ConfigNode calibrated_camera(const ConfigNode& reference, const std::string& path,
                             const std::string& name, ConfigFaults& faults) {
  const std::size_t faults_before = faults.size();
  ConfigNode sections = parse_calibration(reference, path, name, faults);
  if (faults.size() > faults_before) return {};
  if (ConfigNode* const cameras = sections.find("cameras")) {
    for (ConfigNode& camera : cameras->items) {
      if (camera.extract("name").text == name) return std::move(camera);
    }
  }
  add_fault(reference.place, path,
            fmt::format("has no camera \"{}\"; see calibration_camera", name), faults);
  return {};
}

void add_camera_calibration(ConfigNode& camera, const std::string& path, ConfigFaults& faults) {
  const auto reference = extract_text(&camera, path, "calibration", faults);
  const auto wanted = extract_text(&camera, path, "calibration_camera", faults);
  if (!reference && wanted) {
    add_fault(wanted->place, path + ".calibration_camera", "has no effect without calibration",
              faults);
  }
  if (!reference) return;
  const ConfigNode* const named = camera.find("name");
  const std::string name = wanted ? wanted->text : named != nullptr ? named->text : "";
  add_missing_keys(camera, calibrated_camera(*reference, path + ".calibration", name, faults));
}

void add_imu_calibration(ConfigNode& root, ConfigFaults& faults) {
  ConfigNode* const imu = root.find("imu");
  const std::string path = "imu.calibration";
  const auto reference = extract_text(imu, "imu", "calibration", faults);
  if (!reference) return;
  ConfigNode sections = parse_calibration(*reference, path, "", faults);
  const bool has_imu = sections.find("imu") != nullptr;
  if (sections.is_mapping() && !has_imu)
    add_fault(reference->place, path, "says nothing of an inertial sensor", faults);
  add_missing_keys(*imu, has_imu ? sections.extract("imu") : ConfigNode{});
}

/// The file that a value names, wherever this program was started: relative names start at the
/// folder of the file that has them.
fs::path beside(const ConfigNode& name) {
  const fs::path file = fs::path(name.place.file).parent_path() / name.text;
  std::error_code error;
  fs::path absolute = fs::absolute(file, error);
  return (error ? file : absolute).lexically_normal();
}

void place_folder(ConfigNode& camera) {
  ConfigNode* const folder = camera.is_mapping() ? camera.find("folder") : nullptr;
  if (folder != nullptr && folder->is_text() && !folder->text.empty())
    folder->text = beside(*folder).string();
}

/// Keys stay in their files. Whether they can be read is checked before the daemon starts.
template <class Key>
void place_key_file(ConfigNode& root, std::string_view key, Result<Key> (*read)(const fs::path&),
                    ConfigFaults& faults) {
  ConfigNode* const net = root.find("net");
  ConfigNode* const name = net == nullptr ? nullptr : net->find(key);
  if (name == nullptr || !name->is_text() || name->text.empty()) return;
  const fs::path file = beside(*name);
  if (const Result<Key> found = read(file); !found)
    return add_fault(name->place, fmt::format("net.{}", key), found.error().message, faults);
  name->text = file.string();
}

ConfigNode with_references(ConfigNode root, ConfigFaults& faults) {
  add_members(root, faults);
  add_imu_calibration(root, faults);
  place_key_file(root, "key_file", read_mesh_key, faults);
  place_key_file(root, "robot_key_file", read_robot_key, faults);
  if (ConfigNode* const cameras = root.find("cameras"); cameras != nullptr && cameras->is_list()) {
    for (std::size_t i = 0; i < cameras->items.size(); ++i) {
      place_folder(cameras->items[i]);
      add_camera_calibration(cameras->items[i], fmt::format("cameras[{}]", i), faults);
    }
  }
  return root;
}

}  // namespace

ConfigNode load_config_tree(const fs::path& path, ConfigFaults& faults) {
  ConfigNode root = parse_file(path, faults);
  // Fragments alone lack almost everything, which is no fault of theirs.
  if (root.kind == ConfigNode::Kind::kNothing && !faults.empty()) return root;
  for (const fs::path& fragment : fragments_of(path, ".yaml", faults)) {
    ConfigNode over = parse_file(fragment, faults);
    // A fragment whose lines are all commented out changes nothing.
    if (over.kind != ConfigNode::Kind::kNothing) root = merged(std::move(root), std::move(over));
  }
  return with_references(std::move(root), faults);
}

std::vector<ConfigFault> ignored_fragments(const fs::path& path) {
  ConfigFaults unreadable;  // reported where the fragments are read
  ConfigFaults ignored;
  for (const fs::path& file : fragments_of(path, ".yml", unreadable))
    ignored.push_back({file.string(), 0, "", "is ignored: rename it, so that it ends in .yaml"});
  return ignored;
}

ConfigNode parse_config_tree(const std::string& text, const std::string& file,
                             ConfigFaults& faults) {
  return with_references(parse_yaml(text, file, faults), faults);
}

}  // namespace crepes
