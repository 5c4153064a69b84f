#include "daemon/ctl/calibrate/calibration_report.hpp"

#include <nlohmann/json.hpp>

#include "daemon/ctl/json_line.hpp"
#include "daemon/ctl/replaceable.hpp"

namespace crepes {

nlohmann::ordered_json report_head(const std::vector<std::string>& reasons,
                                   const std::vector<std::string>& warnings) {
  return {{"ok", reasons.empty()}, {"reasons", reasons}, {"warnings", warnings}};
}

std::string failed_report(const Error& error) {
  return json_line(report_head({error.message}, {}));
}

std::string warning_lines(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& warning : warnings) text += "warning: " + warning + "\n";
  return text;
}

Result<void> check_results(const std::vector<std::filesystem::path>& files, const std::string& tool,
                           bool force) {
  for (const std::filesystem::path& file : files) {
    if (force) break;
    if (auto free = check_replaceable(file, "crepesctl calibrate " + tool); !free) return free;
  }
  return {};
}

std::filesystem::path beside(const std::filesystem::path& file, const std::string& suffix) {
  std::filesystem::path other = file;
  return other.replace_extension(suffix);
}

}  // namespace crepes
