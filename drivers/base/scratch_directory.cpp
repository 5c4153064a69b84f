#include "drivers/base/scratch_directory.hpp"

#include <fmt/core.h>

#include <cstdlib>
#include <string>
#include <utility>

#include "drivers/base/io_failure.hpp"

namespace crepes {

namespace fs = std::filesystem;

Result<ScratchDirectory> ScratchDirectory::create(const fs::path& keep) {
  std::error_code status;
  if (!keep.empty()) {
    fs::create_directories(keep, status);
    if (status) return fail(ErrorCode::kIo, fmt::format("{}: {}", keep.string(), status.message()));
    return ScratchDirectory(keep, false);
  }
  std::string name = (fs::temp_directory_path(status) / "crepes-XXXXXX").string();
  if (status) return fail(ErrorCode::kIo, "TMPDIR or /tmp: " + status.message());
  if (::mkdtemp(name.data()) == nullptr) return io_failure(name);
  return ScratchDirectory(name, true);
}

ScratchDirectory::ScratchDirectory(ScratchDirectory&& other) noexcept
    : path_(std::move(other.path_)), is_temporary_(std::exchange(other.is_temporary_, false)) {}

ScratchDirectory::~ScratchDirectory() {
  std::error_code status;
  if (is_temporary_) fs::remove_all(path_, status);
}

}  // namespace crepes
