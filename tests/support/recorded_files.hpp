/// Frames in tests/drivers/recorded: what devices sent, and what it says.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/hex.hpp"
#include "tests/support/places.hpp"

namespace crepes {

struct RecordedFrame {
  std::string name;
  std::vector<std::uint8_t> bytes;
  nlohmann::json decoded;
};

/// `name` as in "imu/hipnuc_hi91_official".
inline RecordedFrame recorded_file(const std::string& name) {
  const auto path = source_dir() + "/tests/drivers/recorded/" + name;
  std::ostringstream hex;
  hex << std::ifstream(path + ".hex").rdbuf();
  const auto json = nlohmann::json::parse(std::ifstream(path + ".json"));
  return {name, bytes_of(hex.str()), json.at("decoded")};
}

/// All of a folder, "imu" or "nlink", in the order of their names.
inline std::vector<RecordedFrame> recorded_files(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry :
       std::filesystem::directory_iterator(source_dir() + "/tests/drivers/recorded/" + folder)) {
    if (entry.path().extension() == ".hex")
      names.push_back(folder + "/" + entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  std::vector<RecordedFrame> files;
  for (const std::string& name : names) files.push_back(recorded_file(name));
  return files;
}

}  // namespace crepes
