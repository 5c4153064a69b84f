/// Writes the folder of one robot of a data set while measurements arrive.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "estimator/core/result.hpp"
#include "estimator/core/time.hpp"

namespace crepes {

/// Creates folders and files as needed. An existing file is replaced on the first write. Appended
/// rows are in the file when `append` returns.
class RobotFolder {
 public:
  explicit RobotFolder(std::filesystem::path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] Result<void> write_config(std::string_view text);
  /// Rows as `append_rows` makes them, of `imu0`, `uwb0`, or the spots of `cam0`, `cam1`, ...
  [[nodiscard]] Result<void> append(const std::string& sensor, std::string_view rows);
  /// A picture of `cam0`, `cam1`, ..., compressed as PNG.
  [[nodiscard]] Result<void> add_picture(const std::string& camera, Timestamp stamp,
                                         std::span<const std::uint8_t> png);

  [[nodiscard]] const std::filesystem::path& path() const { return folder_; }
  /// Bytes written so far.
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  [[nodiscard]] Result<void> append_to(const std::filesystem::path& file, std::string_view header,
                                       std::string_view text);

  std::filesystem::path folder_;
  std::map<std::filesystem::path, std::ofstream> files_;
  std::uint64_t bytes_ = 0;
};

/// Writes a whole file, and creates its folders.
[[nodiscard]] Result<void> write_text_file(const std::filesystem::path& file,
                                           std::string_view text);

}  // namespace crepes
