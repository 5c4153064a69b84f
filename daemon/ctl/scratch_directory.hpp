/// A directory for one run.
#pragma once

#include <filesystem>

#include "estimator/core/result.hpp"

namespace crepes {

/// A temporary one goes away with this object.
class ScratchDirectory {
 public:
  /// `keep`, made if need be and never removed; or a fresh temporary directory if that is empty.
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
