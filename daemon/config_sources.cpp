#include "daemon/config_sources.hpp"

#include <algorithm>
#include <fstream>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "daemon/imported_calibration.hpp"
#include "daemon/mesh_key.hpp"
#include "estimator/core/result.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

using Faults = std::vector<ConfigFault>;

constexpr std::uintmax_t kMaxFileBytes = 1 << 20;

Result<std::string> read_text(const fs::path& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return fail(ErrorCode::kIo, "is a directory");
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return fail(ErrorCode::kNotFound,
                "cannot be opened: " + std::generic_category().message(errno));
  }
  std::string text(kMaxFileBytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) return fail(ErrorCode::kIo, "cannot be read");
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMaxFileBytes) return fail(ErrorCode::kFormat, "is larger than 1 MiB");
  return text;
}

/// A file as far as it can be read; nothing, and a fault more, where it cannot.
ConfigNode parse_file(const fs::path& path, Faults& faults) {
  const Result<std::string> text = read_text(path);
  if (text) return parse_yaml(*text, path.string(), faults);
  faults.push_back({path.string(), 0, "", text.error().message});
  return {.place = {path.string(), 1}};
}

std::vector<fs::path> fragments_of(const fs::path& path, Faults& faults) {
  const fs::path folder = path.parent_path() / (path.stem().string() + ".d");
  std::vector<fs::path> files;
  std::error_code error;
  if (!fs::exists(folder, error)) return files;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error))
    if (entry->path().extension() == ".yaml") files.push_back(entry->path());
  if (error) faults.push_back({folder.string(), 0, "", error.message()});
  std::ranges::sort(files);
  return files;
}

void add_fault(const Place& place, const std::string& key, std::string reason, Faults& faults) {
  faults.push_back({place.file, place.line, key, std::move(reason)});
}

/// The value of a key that is a text, taken out of its mapping.
std::optional<ConfigNode> take_text(ConfigNode* mapping, const std::string& path,
                                    std::string_view key, Faults& faults) {
  if (mapping == nullptr || mapping->find(key) == nullptr) return std::nullopt;
  ConfigNode value = mapping->take(key);
  if (value.is_text() && !value.text.empty()) return value;
  add_fault(value.place, path + '.' + std::string(key), "expected a name, found " + describe(value),
            faults);
  mapping->is_incomplete = true;
  return std::nullopt;
}

/// Gives a mapping the keys that it does not have itself. `below` is nothing where faults have
/// been told.
void lay_under(ConfigNode& mapping, ConfigNode below) {
  const Place place = mapping.place;
  const bool is_incomplete = mapping.is_incomplete || !below.is_mapping();
  if (below.is_mapping()) mapping = merged(std::move(below), std::move(mapping));
  mapping.place = place;
  mapping.is_incomplete = is_incomplete;
}

/// The file that `reference` names; a mapping, or nothing and faults more.
ConfigNode parse_named(const ConfigNode& reference, const std::string& path, Faults& faults) {
  const fs::path file = fs::path(reference.place.file).parent_path() / reference.text;
  const auto refuse = [&](const std::string& reason) {
    add_fault(reference.place, path, file.string() + reason, faults);
    return ConfigNode{};
  };
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return refuse(" is not a file");
  const std::size_t faults_before = faults.size();
  ConfigNode root = parse_file(file, faults);
  if (faults.size() > faults_before) return {};
  return root.is_mapping() ? root : refuse(" holds no keys");
}

/// The section `swarm` of a members file, which must have nothing else.
ConfigNode shared_swarm(const ConfigNode& reference, const std::string& path, Faults& faults) {
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
  return faults.size() > faults_before ? ConfigNode{} : root.take("swarm");
}

void add_members(ConfigNode& root, Faults& faults) {
  ConfigNode* const swarm = root.find("swarm");
  const auto reference = take_text(swarm, "swarm", "members_file", faults);
  if (!reference) return;
  if (const ConfigNode* const here = swarm->find("members"))
    return add_fault(here->place, "swarm.members", "is given beside swarm.members_file", faults);
  lay_under(*swarm, shared_swarm(*reference, "swarm.members_file", faults));
}

void move_to(const Place& place, ConfigNode& node) {
  node.place = place;
  for (ConfigNode& item : node.items) move_to(place, item);
}

/// A calibration as the sections `cameras` and `imu`, whose values all stand where their camera
/// does; nothing, and faults more, where it is none.
ConfigNode parse_calibration(const ConfigNode& reference, const std::string& path, Faults& faults) {
  const ConfigNode root = parse_named(reference, path, faults);
  if (!root.is_mapping()) return {};
  const std::size_t faults_before = faults.size();
  const ImportedCalibration calibration = read_calibration(root, faults);
  if (faults.size() > faults_before) return {};
  ConfigNode sections = parse_yaml(calibration_text(calibration), root.place.file, faults);
  for (std::size_t i = 0; i < calibration.cameras.size(); ++i)
    move_to(place_of(root, calibration.cameras[i].name), sections.find("cameras")->items[i]);
  if (calibration.imu) move_to(place_of(root, "imu0"), *sections.find("imu"));
  return sections;
}

/// What a calibration says of the camera `name`.
ConfigNode calibrated_camera(const ConfigNode& reference, const std::string& path,
                             const std::string& name, Faults& faults) {
  ConfigNode sections = parse_calibration(reference, path, faults);
  if (!sections.is_mapping()) return {};
  if (ConfigNode* const cameras = sections.find("cameras")) {
    for (ConfigNode& camera : cameras->items) {
      if (camera.take("name").text == name) return std::move(camera);
    }
  }
  add_fault(reference.place, path, "has no camera \"" + name + "\"; see calibration_camera",
            faults);
  return {};
}

void add_camera_calibration(ConfigNode& camera, const std::string& path, Faults& faults) {
  const auto reference = take_text(&camera, path, "calibration", faults);
  const auto wanted = take_text(&camera, path, "calibration_camera", faults);
  if (!reference) return;
  const ConfigNode* const named = camera.find("name");
  const std::string name = wanted ? wanted->text : named != nullptr ? named->text : "";
  lay_under(camera, calibrated_camera(*reference, path + ".calibration", name, faults));
}

void add_imu_calibration(ConfigNode& root, Faults& faults) {
  ConfigNode* const imu = root.find("imu");
  const std::string path = "imu.calibration";
  const auto reference = take_text(imu, "imu", "calibration", faults);
  if (!reference) return;
  ConfigNode sections = parse_calibration(*reference, path, faults);
  const bool has_imu = sections.find("imu") != nullptr;
  if (sections.is_mapping() && !has_imu)
    add_fault(reference->place, path, "says nothing of an inertial sensor", faults);
  lay_under(*imu, has_imu ? sections.take("imu") : ConfigNode{});
}

/// The key stays in its file; whether it can be read from there is known before all begins.
void place_key_file(ConfigNode& root, Faults& faults) {
  ConfigNode* const net = root.find("net");
  ConfigNode* const name = net == nullptr ? nullptr : net->find("key_file");
  if (name == nullptr || !name->is_text() || name->text.empty()) return;
  const fs::path file = fs::path(name->place.file).parent_path() / name->text;
  const Result<MeshKey> key = read_mesh_key(file);
  if (!key) return add_fault(name->place, "net.key_file", key.error().message, faults);
  name->text = file.string();
}

ConfigNode with_references(ConfigNode root, Faults& faults) {
  add_members(root, faults);
  add_imu_calibration(root, faults);
  place_key_file(root, faults);
  if (ConfigNode* const cameras = root.find("cameras"); cameras != nullptr && cameras->is_list()) {
    for (std::size_t i = 0; i < cameras->items.size(); ++i)
      add_camera_calibration(cameras->items[i], "cameras[" + std::to_string(i) + "]", faults);
  }
  return root;
}

}  // namespace

ConfigNode gather_config(const fs::path& path, Faults& faults) {
  ConfigNode root = parse_file(path, faults);
  for (const fs::path& fragment : fragments_of(path, faults)) {
    ConfigNode over = parse_file(fragment, faults);
    // One whose lines are all commented out says nothing.
    if (over.kind != ConfigNode::Kind::kNothing) root = merged(std::move(root), std::move(over));
  }
  return with_references(std::move(root), faults);
}

ConfigNode gather_config_text(const std::string& text, const std::string& file, Faults& faults) {
  return with_references(parse_yaml(text, file, faults), faults);
}

}  // namespace crepes
