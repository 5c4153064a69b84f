/// A result that has its name only when it is whole.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/core/result.hpp"

namespace crepes {

/// A text file that grows as NAME.part and is called NAME from `publish` on.
class PartFile {
 public:
  /// Removes a NAME that is there already.
  [[nodiscard]] static Result<PartFile> create(std::filesystem::path file, std::string_view header);

  /// Where to append; call `flush_if_large` now and then. Failures of the disk are told by
  /// `publish`.
  [[nodiscard]] std::string& text() { return text_; }
  void flush_if_large();

  [[nodiscard]] Result<void> publish();

 private:
  explicit PartFile(std::filesystem::path file) : file_(std::move(file)) {}
  void flush();

  std::filesystem::path file_;
  std::string text_;
  std::optional<Error> failure_;
};

}  // namespace crepes
