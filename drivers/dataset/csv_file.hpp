/// Reads a CSV file of the data set row by row, and reports every fault.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "drivers/base/number_text.hpp"
#include "drivers/dataset/dataset_faults.hpp"
#include "estimator/core/result.hpp"

namespace crepes {

/// The rows of a file whose first line is a header. A row with a wrong number of columns, a last
/// line without its end (it may have lost digits) and a header without '#' are added to the faults;
/// in the last case the line counts as a row.
class CsvFile {
 public:
  static constexpr std::size_t kMaxColumns = 48;

  /// How the line of column names begins.
  enum class Header { kHash, kPlain };

  [[nodiscard]] static Result<CsvFile> open(const std::filesystem::path& file, std::size_t columns,
                                            DatasetFaults& faults, Header header = Header::kHash);

  /// Goes to the next row with the right number of columns; false at the end.
  [[nodiscard]] bool next(DatasetFaults& faults);

  /// The first line, unless it counted as a row.
  [[nodiscard]] std::string_view header() const;
  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::string_view field(std::size_t column) const { return fields_.at(column); }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Reads the number in `column`; on failure adds this row to the faults and returns false.
  template <class Number>
  [[nodiscard]] bool read(std::size_t column, Number& value, DatasetFaults& faults) const {
    const std::string_view wrong = parse_number(field(column), value);
    if (wrong.empty()) return true;
    refuse(wrong, column, faults);
    return false;
  }

 private:
  CsvFile(std::filesystem::path path, std::string text, std::size_t columns)
      : path_(std::move(path)), text_(std::move(text)), columns_(columns) {}

  void refuse(std::string_view wrong, std::size_t column, DatasetFaults& faults) const;
  [[nodiscard]] std::size_t split(std::string_view row);

  std::filesystem::path path_;
  std::string text_;
  std::size_t columns_;
  std::size_t header_size_ = 0;
  std::size_t position_ = 0;
  std::size_t line_ = 0;
  std::array<std::string_view, kMaxColumns> fields_{};
};

}  // namespace crepes
