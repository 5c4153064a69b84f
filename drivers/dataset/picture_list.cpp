#include "drivers/dataset/picture_list.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/base/number_text.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

bool is_picture(const fs::path& file) {
  constexpr std::array<std::string_view, 8> kExtensions{".png",  ".pgm", ".bmp",  ".jpg",
                                                        ".jpeg", ".tif", ".tiff", ".webp"};
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](char c) {
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  });
  return std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end();
}

Result<std::vector<fs::path>> pictures_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code status;
  for (fs::directory_iterator entry(folder, status), end; !status && entry != end;
       entry.increment(status)) {
    if (is_picture(entry->path())) files.push_back(entry->path());
  }
  if (status) return fail(ErrorCode::kIo, fmt::format("{}: {}", folder.string(), status.message()));
  if (files.empty()) return fail(ErrorCode::kNotFound, folder.string() + ": holds no pictures");
  std::sort(files.begin(), files.end());
  return files;
}

/// In the order of the numbers that are their names; empty if a name is not a number.
std::optional<std::vector<RecordedPicture>> by_name(const std::vector<fs::path>& files) {
  std::vector<RecordedPicture> list;
  for (const fs::path& file : files) {
    std::int64_t ns = 0;
    if (!parse_number(file.stem().string(), ns).empty()) return std::nullopt;
    list.push_back({Timestamp{Duration{ns}}, file});
  }
  std::stable_sort(list.begin(), list.end(),
                   [](const auto& a, const auto& b) { return a.stamp < b.stamp; });
  return list;
}

std::vector<RecordedPicture> by_rate(const std::vector<fs::path>& files, double rate_hz) {
  std::vector<RecordedPicture> list;
  list.reserve(files.size());
  for (const fs::path& file : files)
    list.push_back({Timestamp{from_seconds(static_cast<double>(list.size()) / rate_hz)}, file});
  return list;
}

}  // namespace

Result<std::vector<RecordedPicture>> list_pictures(const fs::path& source, double rate_hz) {
  std::error_code status;
  if (!fs::exists(source, status))
    return fail(ErrorCode::kNotFound, source.string() + ": no such picture or folder");
  if (!fs::is_directory(source, status)) return std::vector<RecordedPicture>{{Timestamp{}, source}};
  // "cam0/data/" and "cam0/data" are the same folder, beside "cam0/data.csv".
  const fs::path folder = (source / "").lexically_normal().parent_path();
  if (fs::exists(folder / "data.csv", status))
    return read_picture_list(folder / "data.csv", folder / "data");
  if (folder.filename() == "data" && fs::exists(folder.parent_path() / "data.csv", status))
    return read_picture_list(folder.parent_path() / "data.csv", folder);
  const auto files = pictures_in(folder);
  if (!files) return tl::unexpected(files.error());
  auto list = by_name(*files);
  if (!list) return by_rate(*files, rate_hz);
  const auto same = std::adjacent_find(
      list->begin(), list->end(), [](const auto& a, const auto& b) { return a.stamp == b.stamp; });
  if (same == list->end()) return std::move(*list);
  return fail(ErrorCode::kFormat, fmt::format("{} and {} say the same time", same->file.string(),
                                              (same + 1)->file.string()));
}

std::size_t camera_index_of(const fs::path& source) {
  std::size_t index = 0;
  std::error_code status;
  for (const fs::path& part : fs::absolute(source, status).lexically_normal()) {
    const std::string name = part.string();
    if (!name.starts_with("cam")) continue;
    std::size_t number = 0;
    if (parse_number(std::string_view(name).substr(3), number).empty()) index = number;
  }
  return index;
}

}  // namespace crepes
