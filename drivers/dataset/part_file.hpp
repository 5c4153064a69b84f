/// A file that has its final name only when it is complete.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/core/result.hpp"

namespace crepes {

/// Replaces a text file at once: readers see the former content or the new one.
[[nodiscard]] Result<void> replace_text_file(const std::filesystem::path& file,
                                             std::string_view text);

/// A text file that is written as NAME.part. `publish` renames it to NAME; an earlier NAME stays
/// until then. What is no regular file, a pipe or a device, is written at once.
class PartFile {
 public:
  [[nodiscard]] static Result<PartFile> create(std::filesystem::path file, std::string_view header);

  /// The text to append to; call `flush_if_large` regularly. `publish` reports write errors.
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
