#include "drivers/dataset/robot_folder.hpp"

#include <fmt/core.h>

#include <system_error>

#include "drivers/base/io_failure.hpp"
#include "drivers/dataset/dataset_rows.hpp"
#include "drivers/dataset/part_file.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

std::string_view header_of(const std::string& sensor) {
  if (sensor == "imu0") return kImuHeader;
  return sensor == "uwb0" ? kRangeHeader : kSpotHeader;
}

}  // namespace

Result<void> write_text_file(const fs::path& file, std::string_view text) {
  std::error_code status;
  if (file.has_parent_path()) fs::create_directories(file.parent_path(), status);
  if (status) return fail(ErrorCode::kIo, file.parent_path().string() + ": " + status.message());
  return replace_text_file(file, text);
}

Result<void> RobotFolder::write_config(std::string_view text) {
  bytes_ += text.size();
  return write_text_file(folder_ / "crepesd.yaml", text);
}

Result<void> RobotFolder::append(const std::string& sensor, std::string_view rows) {
  const bool is_camera = sensor.starts_with("cam");
  return append_to(folder_ / sensor / (is_camera ? "spots.csv" : "data.csv"), header_of(sensor),
                   rows);
}

Result<void> RobotFolder::add_picture(const std::string& camera, Timestamp stamp,
                                      std::span<const std::uint8_t> png) {
  const std::string t_ns = std::to_string(to_ns(stamp));
  const std::string bytes(png.begin(), png.end());
  if (auto done = write_text_file(folder_ / camera / "data" / (t_ns + ".png"), bytes); !done)
    return done;
  bytes_ += bytes.size();
  return append_to(folder_ / camera / "data.csv", kPictureHeader,
                   fmt::format("{0},{0}.png\n", t_ns));
}

Result<void> RobotFolder::append_to(const fs::path& file, std::string_view header,
                                    std::string_view text) {
  std::ofstream& out = files_[file];
  if (!out.is_open()) {
    std::error_code status;
    fs::create_directories(file.parent_path(), status);
    out.open(file, std::ios::binary);
    out << header;
    bytes_ += header.size();
  } else if (std::error_code status; !fs::exists(file, status)) {
    return fail(ErrorCode::kIo, file.string() + ": was removed while it was written");
  }
  out << text << std::flush;
  bytes_ += text.size();
  if (!out) return io_failure(file.string());
  return {};
}

}  // namespace crepes
