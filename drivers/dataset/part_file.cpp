#include "drivers/dataset/part_file.hpp"

#include <fmt/core.h>

#include <fstream>
#include <utility>

#include "drivers/base/io_failure.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

/// What a link leads to keeps its name, and the link too.
fs::path target_of(const fs::path& file) {
  std::error_code status;
  if (!fs::is_symlink(file, status)) return file;
  fs::path target = fs::weakly_canonical(file, status);
  return status ? file : target;
}

/// A device or a pipe is written as it is: another file must not take its name.
fs::path part_of(fs::path file) {
  std::error_code status;
  const bool is_special = fs::exists(file, status) && !fs::is_regular_file(file, status);
  return is_special ? file : file += ".part";
}

Result<void> write_text(const fs::path& file, std::string_view text, std::ios::openmode mode) {
  std::ofstream out(file, std::ios::binary | mode);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  out.close();
  if (out) return {};
  return io_failure(file.string());
}

/// Gives the written part its final name.
Result<void> publish_part(const fs::path& file) {
  const fs::path part = part_of(file);
  if (part == file) return {};
  std::error_code status;
  fs::rename(part, file, status);
  if (!status) return {};
  return fail(ErrorCode::kIo, fmt::format("{}: {}", file.string(), status.message()));
}

/// Removes what could not be written.
void discard_part(const fs::path& file) {
  const fs::path part = part_of(file);
  std::error_code ignored;
  if (part != file) fs::remove(part, ignored);
}

}  // namespace

Result<void> replace_text_file(const fs::path& file, std::string_view text) {
  const fs::path target = target_of(file);
  auto done = write_text(part_of(target), text, std::ios::trunc);
  if (done) return publish_part(target);
  discard_part(target);
  return done;
}

Result<PartFile> PartFile::create(fs::path file, std::string_view header) {
  file = target_of(file);
  if (auto done = write_text(part_of(file), header, std::ios::trunc); !done) {
    discard_part(file);
    return tl::unexpected(done.error());
  }
  return PartFile(std::move(file));
}

void PartFile::flush_if_large() {
  constexpr std::size_t kFlushAt = 1 << 16;
  if (text_.size() >= kFlushAt) flush();
}

void PartFile::flush() {
  const auto done = write_text(part_of(file_), text_, std::ios::app);
  if (!done && !failure_) failure_ = done.error();
  text_.clear();
}

Result<void> PartFile::publish() {
  flush();
  if (failure_) {
    discard_part(file_);
    return tl::unexpected(*failure_);
  }
  return publish_part(file_);
}

}  // namespace crepes
