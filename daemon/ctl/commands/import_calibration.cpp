#include "daemon/ctl/setup/import_calibration.hpp"

#include "daemon/ctl/commands/command_line.hpp"
#include "daemon/ctl/commands/commands.hpp"

namespace crepes {

void add_import_calibration(CommandLine& line) {
  auto& files = line.make<std::vector<std::filesystem::path>>();
  auto& out = line.make<OutputFile>();
  auto& json = line.make<bool>();
  CLI::App* sub = line.add(
      "import-calibration",
      "Read calibrations of Kalibr (camchain-imucam.yaml, imu.yaml) or Basalt (calibration.json) "
      "and write the sections cameras and imu of a configuration");
  sub->add_option("FILE", files, "calibration files of one robot")->required();
  add_output_options(sub, out);
  add_json_flag(sub, json, "these sections, which are also valid in a configuration");
  line.run(sub, [&files, &out, &json] {
    return import_calibration(files, json).and_then([&](const std::string& text) {
      // JSON has no comment: an earlier result begins with the same section.
      const std::string mark =
          json ? text.substr(0, text.find(':')) : "crepesctl import-calibration";
      return write_output(text, out, mark);
    });
  });
}

}  // namespace crepes
