#include "config/reading/config_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <tuple>

#include "config/keys/robot_key.hpp"
#include "config/reading/config_reader.hpp"
#include "config/reading/config_sources.hpp"
#include "config/schema/plausibility.hpp"
#include "config/schema/validation.hpp"
#include "config/writing/config_writer.hpp"

namespace crepes {
namespace {

bool is_inside(std::string_view path, std::string_view parent) {
  return path.starts_with(parent) &&
         (path.size() == parent.size() || path[parent.size()] == '.' || path[parent.size()] == '[');
}

/// Adds the broken rules, except those for values in which the reader has already found a fault.
void add_rule_faults(const Config& config, ReadLog& log) {
  const auto unread = log.unread;
  for (RuleFault& rule : validate(config)) {
    const bool is_reported = std::ranges::any_of(unread, [&](const std::string& path) {
      return is_inside(path, rule.key) || is_inside(rule.key, path);
    });
    if (!is_reported) log.fault(rule.key, std::move(rule.reason));
  }
}

/// Adds a fault if the robot's key is not the one that the others know. `config` keeps all rules.
void add_key_fault(const Config& config, ReadLog& log) {
  const std::vector<MemberConfig>& members = config.swarm.members;
  const auto own = std::ranges::find(members, config.robot.id, &MemberConfig::id);
  if (config.net.robot_key_file.empty() || own == members.end() || !own->public_key) return;
  const Result<RobotKey> key = read_robot_key(config.net.robot_key_file);
  if (!key) return log.fault("net.robot_key_file", key.error().message);
  const std::string known = to_text(public_key_of(*key));
  if (known != *own->public_key) {
    log.fault("net.robot_key_file",
              fmt::format("its public key is {}, swarm.members has another one for this robot: {}",
                          known, *own->public_key));
  }
}

/// Those of the reader, and doubtful settings.
std::vector<ConfigFault> warnings_of(const Config& config, ReadLog& log) {
  std::vector<ConfigFault> warnings = std::move(log.warnings);
  for (RuleFault& doubt : doubtful_settings(config)) {
    const Place place = place_of(log.root, doubt.key);
    warnings.push_back({place.file, place.line, std::move(doubt.key), std::move(doubt.reason)});
  }
  return warnings;
}

/// Control characters as \xNN.
std::string escaped(std::string_view text) {
  std::string plain;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    constexpr unsigned char kSpace = 0x20;
    constexpr unsigned char kDelete = 0x7f;
    plain += code < kSpace || code == kDelete ? fmt::format("\\x{:02x}", code) : std::string(1, c);
  }
  return plain;
}

/// `faults` are those found while `root` was merged from its files.
CheckedConfig read_config(const ConfigNode& root, std::vector<ConfigFault> faults) {
  CheckedConfig checked;
  ReadLog log(root);
  for (const ConfigFault& fault : faults) log.unread.insert(fault.key);
  const bool is_document = root.kind != ConfigNode::Kind::kNothing;
  if (!is_document && faults.empty()) log.fault("", "is empty");
  if (is_document) {
    ConfigReader reader(root, "", log);
    checked.config.visit(reader);
    reader.finish();
    if (root.is_mapping()) add_rule_faults(checked.config, log);
    if (log.faults.empty() && faults.empty()) add_key_fault(checked.config, log);
  }
  std::ranges::move(log.faults, std::back_inserter(faults));
  std::ranges::stable_sort(
      faults, {}, [](const ConfigFault& fault) { return std::tie(fault.file, fault.line); });
  checked.faults = std::move(faults);
  if (checked.faults.empty()) checked.warnings = warnings_of(checked.config, log);
  return checked;
}

}  // namespace

std::string to_string(const ConfigFault& fault) {
  const std::string key = fault.key.empty() ? "" : fault.key + ": ";
  const std::string line = fault.line <= 0 ? "" : fmt::format("{}:", fault.line);
  return escaped(fmt::format("{}:{} {}{}", fault.file, line, key, fault.reason));
}

std::string to_string(const std::vector<ConfigFault>& faults) {
  std::string lines;
  for (const ConfigFault& fault : faults)
    lines += fmt::format("{}{}", lines.empty() ? "" : "\n", to_string(fault));
  return lines;
}

bool is_in_section(const ConfigFault& fault, std::string_view section) {
  return is_inside(fault.key, section);
}

CheckedConfig check_config_text(const std::string& text, const std::string& file) {
  std::vector<ConfigFault> faults;
  const ConfigNode root = parse_config_tree(text, file, faults);
  return read_config(root, std::move(faults));
}

CheckedConfig check_config(const std::filesystem::path& path) {
  std::vector<ConfigFault> faults;
  const ConfigNode root = load_config_tree(path, faults);
  CheckedConfig checked = read_config(root, std::move(faults));
  for (ConfigFault& warning : ignored_fragments(path))
    checked.warnings.push_back(std::move(warning));
  return checked;
}

Result<Config> load_config(const std::filesystem::path& path) {
  CheckedConfig checked = check_config(path);
  if (checked.faults.empty()) return std::move(checked.config);
  return fail(ErrorCode::kConfig, to_string(checked.faults));
}

std::string write_config(const Config& config) {
  Config copy = config;  // visit() serves readers too, so it needs mutable fields
  ConfigWriter writer;
  copy.visit(writer);
  return writer.text();
}

std::string reference_config() {
  Config config;
  config.robot.id = RobotId{1};
  config.swarm.members.resize(2);
  config.swarm.members[0].id = RobotId{1};
  config.swarm.members[0].name = "r1";
  config.swarm.members[0].pattern = "011111111111111111";
  config.swarm.members[1].id = RobotId{2};
  config.swarm.members[1].name = "r2";
  config.swarm.members[1].pattern = "001001011111111111";
  // Double Sphere of a 185 degree lens; the camera looks along the body's x axis.
  Eigen::Matrix3d R_C_B;
  R_C_B << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  CameraConfig camera;
  camera.calibration.name = "cam0";
  camera.calibration.intrinsics = {-0.1723, 0.5931, 316.76, 316.66, 637.63, 512.69};
  camera.calibration.resolution = {1280, 1024};
  camera.calibration.T_cam_imu.q = Eigen::Quaterniond(R_C_B);
  config.cameras = {camera};
  return "# Every key of crepesd.yaml with its default and bounds. Unknown keys are errors; keys "
         "without\n"
         "# \"required\" may be omitted. Changes of a section marked live are applied on SIGHUP, "
         "those of a\n"
         "# section marked restart when crepesd starts again. Written by `crepesd "
         "--write-reference`.\n" +
         write_config(config);
}

}  // namespace crepes
