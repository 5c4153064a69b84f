#include "daemon/config_file.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <system_error>

#include "daemon/config_reader.hpp"
#include "daemon/config_rules.hpp"
#include "daemon/config_writer.hpp"

namespace crepes {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 1 << 20;

bool is_inside(std::string_view path, std::string_view parent) {
  return path.starts_with(parent) &&
         (path.size() == parent.size() || path[parent.size()] == '.' || path[parent.size()] == '[');
}

/// Line of a key, or of the nearest thing around it that the file has.
int line_of_key(const ReadLog& log, std::string key) {
  for (;;) {
    if (const auto it = log.lines.find(key); it != log.lines.end()) return it->second;
    const std::size_t end = key.find_last_of(".[");
    if (end == std::string::npos) return 1;
    key.resize(end);
  }
}

/// Adds the broken rules, except where the reader has found fault with the same thing already.
void add_rule_faults(const Config& config, ReadLog& log) {
  const auto unread = log.unread;
  for (RuleFault& rule : validate(config)) {
    const bool told = std::ranges::any_of(unread, [&](const std::string& path) {
      return is_inside(path, rule.key) || is_inside(rule.key, path);
    });
    if (told) continue;
    log.lines.emplace(rule.key, line_of_key(log, rule.key));
    log.fault(rule.key, std::move(rule.reason));
  }
}

class NothingHeard final : public YAML::EventHandler {
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
  NothingHeard nothing;
  int count = 0;
  while (count < 2 && parser.HandleNextDocument(nothing)) ++count;
  return count;
}

Result<std::string> read_text(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return fail(ErrorCode::kIo, "is a directory");
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

}  // namespace

std::string to_string(const ConfigFault& fault) {
  return fault.file + ':' + (fault.line > 0 ? std::to_string(fault.line) + ": " : " ") +
         (fault.key.empty() ? "" : fault.key + ": ") + fault.reason;
}

CheckedConfig check_config_text(const std::string& text, const std::string& file) {
  CheckedConfig checked;
  ReadLog log;
  log.file = file;
  try {
    const int documents = documents_in(text);
    if (documents == 1) {
      const YAML::Node root = YAML::Load(text);
      ConfigReader reader(root, "", log);
      checked.config.visit(reader);
      reader.finish();
      if (root.IsMap()) add_rule_faults(checked.config, log);
    } else {
      log.fault("", documents == 0 ? "is empty" : "holds more than one YAML document");
    }
  } catch (const YAML::Exception& e) {
    log.faults.push_back({file, e.mark.is_null() ? 1 : e.mark.line + 1, "", "not YAML: " + e.msg});
  }
  checked.faults = std::move(log.faults);
  std::ranges::stable_sort(checked.faults, {}, &ConfigFault::line);
  return checked;
}

CheckedConfig check_config(const std::filesystem::path& path) {
  const Result<std::string> text = read_text(path);
  if (!text) return {{}, {{path.string(), 0, "", text.error().message}}};
  return check_config_text(*text, path.string());
}

Result<Config> load_config(const std::filesystem::path& path) {
  CheckedConfig checked = check_config(path);
  if (checked.faults.empty()) return std::move(checked.config);
  std::string message;
  for (const ConfigFault& fault : checked.faults)
    message += (message.empty() ? "" : "\n") + to_string(fault);
  return fail(ErrorCode::kConfig, std::move(message));
}

std::string write_config(const Config& config) {
  Config copy = config;  // visit() serves readers too, so it takes mutable fields
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
  camera.name = "cam0";
  camera.intrinsics = {-0.1723, 0.5931, 316.76, 316.66, 637.63, 512.69};
  camera.resolution = {1280, 1024};
  camera.T_cam_imu.q = Eigen::Quaterniond(R_C_B);
  config.cameras = {camera};
  return "# Every key of crepesd.yaml with its default and bounds. Unknown keys are errors; keys "
         "without\n"
         "# \"required\" may be left out. Written by `crepesd --write-reference`.\n" +
         write_config(config);
}

}  // namespace crepes
