#include "drivers/base/text_file.hpp"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

namespace crepes {

Result<std::string> read_text(const std::filesystem::path& file, std::uintmax_t max_bytes) {
  constexpr std::size_t kChunk = 1U << 16U;
  constexpr std::uintmax_t kMiB = 1U << 20U;
  std::error_code status;
  if (std::filesystem::is_directory(file, status)) return fail(ErrorCode::kIo, "is a directory");
  // Opening a pipe would block; a device may never end.
  if (std::filesystem::exists(file, status) && !std::filesystem::is_regular_file(file, status))
    return fail(ErrorCode::kIo, "is not a file");
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return fail(ErrorCode::kNotFound,
                fmt::format("cannot be opened: {}", std::generic_category().message(errno)));
  }
  std::string text;
  std::array<char, kChunk> chunk{};
  while (in && text.size() <= max_bytes) {
    in.read(chunk.data(), chunk.size());
    text.append(chunk.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (in.bad()) return fail(ErrorCode::kIo, "cannot be read");
  if (text.size() > max_bytes)
    return fail(ErrorCode::kFormat, fmt::format("is larger than {} MiB", max_bytes / kMiB));
  return text;
}

Result<std::string> read_text_file(const std::filesystem::path& file, std::uintmax_t max_bytes) {
  std::error_code status;
  if (!std::filesystem::exists(file, status))
    return fail(ErrorCode::kNotFound, fmt::format("{}: no such file", file.string()));
  if (!std::filesystem::is_regular_file(file, status))
    return fail(ErrorCode::kIo, fmt::format("{}: not a file", file.string()));
  return read_text(file, max_bytes).map_error([&](Error error) {
    return std::move(error).with_context(file.string());
  });
}

}  // namespace crepes
