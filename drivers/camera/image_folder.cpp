#include "drivers/camera/image_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>
#include <utility>

#include "drivers/base/number_text.hpp"
#include "drivers/base/sleep.hpp"

namespace crepes {
namespace {

/// `t_ns,name`.
std::optional<std::pair<Timestamp, std::string>> parse_row(std::string_view row) {
  if (row.ends_with('\r')) row.remove_suffix(1);
  const std::size_t comma = row.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  std::int64_t ns = 0;
  const std::string_view name = row.substr(comma + 1);
  if (!parse_number(row.substr(0, comma), ns).empty() || name.empty() ||
      name.find(',') != std::string_view::npos) {
    return std::nullopt;
  }
  return std::pair(Timestamp{Duration{ns}}, std::string(name));
}

}  // namespace

Result<Frame> read_gray_image(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) {
    return fail(ErrorCode::kNotFound, fmt::format("{}: no such picture", file.string()));
  }
  try {
    const cv::Mat image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
    if (image.empty()) {
      return fail(ErrorCode::kFormat,
                  fmt::format("{}: not a picture that can be read", file.string()));
    }
    Frame frame{.width = image.cols, .height = image.rows, .pixels = {}};
    frame.pixels.reserve(image.total());
    for (int row = 0; row < image.rows; ++row) {
      frame.pixels.insert(frame.pixels.end(), image.ptr(row), image.ptr(row) + image.cols);
    }
    return frame;
  } catch (const cv::Exception& e) {
    return fail(ErrorCode::kFormat, fmt::format("{}: {}", file.string(), e.what()));
  }
}

Result<Frame> read_gray_image(const std::filesystem::path& file, const CameraCalibration& camera) {
  auto frame = read_gray_image(file);
  const auto [width, height] = camera.resolution;
  if (!frame || (frame->width == width && frame->height == height)) return frame;
  return fail(ErrorCode::kFormat,
              fmt::format("{}: is {}x{}, but {} takes pictures of {}x{} (resolution)",
                          file.string(), frame->width, frame->height, camera.name, width, height));
}

Result<std::vector<RecordedPicture>> read_picture_list(const std::filesystem::path& csv,
                                                       const std::filesystem::path& pictures) {
  std::ifstream in(csv);
  if (!in) return fail(ErrorCode::kNotFound, fmt::format("{}: cannot be read", csv.string()));
  std::vector<RecordedPicture> list;
  std::string row;
  for (int line = 1; std::getline(in, row); ++line) {
    if (row.starts_with('#')) continue;
    const auto refuse = [&](const std::string& why) {
      return fail(ErrorCode::kFormat, fmt::format("{}:{}: {}", csv.string(), line, why));
    };
    const auto parsed = parse_row(row);
    if (!parsed) return refuse("expected `t_ns,file name`");
    if (!list.empty() && parsed->first <= list.back().stamp) return refuse("time goes back");
    std::filesystem::path file = pictures / parsed->second;
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored))
      return refuse(fmt::format("{} is missing", file.string()));
    list.push_back({parsed->first, std::move(file)});
  }
  if (list.empty())
    return fail(ErrorCode::kFormat, fmt::format("{}: names no pictures", csv.string()));
  return list;
}

Result<std::unique_ptr<Camera>> FolderCamera::open(const std::filesystem::path& folder,
                                                   const CameraCalibration& camera,
                                                   std::uint8_t index, const Clock& clock) {
  // "cam0/data/" and "cam0/data" are the same folder, beside "cam0/data.csv".
  const std::filesystem::path pictures = (folder / "").lexically_normal().parent_path();
  auto list = read_picture_list(pictures.parent_path() / "data.csv", pictures);
  if (!list) return tl::unexpected(std::move(list.error()));
  return std::unique_ptr<Camera>(new FolderCamera(std::move(*list), camera, index, clock));
}

Result<std::optional<Frame>> FolderCamera::read_once(std::chrono::milliseconds timeout) {
  if (next_ == pictures_.size()) {
    sleep_for(timeout);
    return std::optional<Frame>{};
  }
  const RecordedPicture& picture = pictures_[next_];
  const Timestamp due = begin_ + (picture.stamp - pictures_.front().stamp);
  sleep_for(std::min<Duration>(due - clock_.now(), timeout));
  if (clock_.now() < due) return std::optional<Frame>{};
  ++next_;
  auto frame = read_gray_image(picture.file, camera_);
  if (!frame) {
    ++unreadable_;
    last_error_ = frame.error().message;
    return std::optional<Frame>{};
  }
  frame->stamp = due;
  frame->camera = index_;
  return std::optional(std::move(*frame));
}

SensorTotals FolderCamera::counters() const {
  return {.faults = {{"unreadable_pictures", unreadable_}},
          .counts = {{"frames", next_ - unreadable_}}};
}

std::optional<std::string> FolderCamera::diagnosis() const {
  if (next_ == pictures_.size()) {
    return fmt::format("{}: no more pictures", pictures_.front().file.parent_path().string());
  }
  return last_error_.empty() ? std::nullopt : std::optional(last_error_);
}

}  // namespace crepes
