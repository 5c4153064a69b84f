#include "daemon/ctl/import_calibration.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_import_calibration(CommandLine& line) {
  auto& files = line.keep<std::vector<std::filesystem::path>>();
  auto& out = line.keep<std::string>();
  auto& json = line.keep<bool>();
  CLI::App* sub = line.add(
      "import-calibration",
      "Read calibrations of Kalibr (camchain-imucam.yaml, imu.yaml) or Basalt (calibration.json) "
      "and write the sections cameras and imu of a configuration");
  sub->add_option("FILE", files, "calibration files; together one robot's")->required();
  sub->add_option("--out", out, "file; left out: standard output");
  add_json_flag(sub, json, "these sections, good for a configuration, too");
  line.run(sub, [&files, &out, &json] {
    return import_calibration(files, json).and_then([&](const std::string& text) {
      return deliver(text, out);
    });
  });
}

}  // namespace crepes
