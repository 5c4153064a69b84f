/// A directory for one run.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"

namespace crepes {

/// A temporary directory is removed by the destructor.
class ScratchDirectory {
 public:
  /// Uses `keep`, which is created if needed and never removed; or a new temporary directory if
  /// `keep` is empty.
  [[nodiscard]] static Result<ScratchDirectory> create(const std::filesystem::path& keep);

  ScratchDirectory(ScratchDirectory&& other) noexcept;
  ScratchDirectory& operator=(ScratchDirectory&&) = delete;
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  ~ScratchDirectory();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  ScratchDirectory(std::filesystem::path path, bool is_temporary)
      : path_(std::move(path)), is_temporary_(is_temporary) {}

  std::filesystem::path path_;
  bool is_temporary_;
};

}  // namespace crepes
