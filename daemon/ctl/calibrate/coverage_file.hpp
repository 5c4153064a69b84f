/// The coverage of a `calibrate camera --live` that runs, for the page of `crepesctl view`.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/core/result.hpp"

namespace crepes {

/// A file beside the daemon's socket that exists while the calibration runs. Whoever may record
/// may write it, and whoever may look at the cameras may read it.
class CoverageFile {
 public:
  /// `socket` is that of the daemon's recordings.
  explicit CoverageFile(const std::filesystem::path& socket);
  CoverageFile(const CoverageFile&) = delete;
  CoverageFile& operator=(const CoverageFile&) = delete;
  CoverageFile(CoverageFile&&) = delete;
  CoverageFile& operator=(CoverageFile&&) = delete;
  ~CoverageFile();

  /// Replaces its content; readers see the former or the new one.
  [[nodiscard]] Result<void> write(std::string_view json) const;

 private:
  std::filesystem::path file_;
};

/// The newest coverage of the daemon with this socket, as one line of JSON with the parts that
/// `coverage_json` has. Empty if there is none, if it is older than a few seconds, or no coverage.
[[nodiscard]] std::optional<std::string> read_coverage(const std::filesystem::path& socket);

}  // namespace crepes
