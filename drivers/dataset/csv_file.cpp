#include "drivers/dataset/csv_file.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "drivers/base/text_file.hpp"
#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // spreadsheets write it before UTF-8

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t' || text.back() == '\r'))
    text.remove_suffix(1);
  return text;
}

}  // namespace

Result<CsvFile> CsvFile::open(const std::filesystem::path& file, std::size_t columns,
                              DatasetFaults& faults, Header header) {
  CREPES_EXPECT(columns > 0 && columns <= kMaxColumns, "more columns than a row holds");
  Result<std::string> text = read_text_file(file);
  if (!text) return tl::unexpected(text.error());
  if (text->starts_with(kByteOrderMark)) text->erase(0, kByteOrderMark.size());
  CsvFile csv(file, std::move(*text), columns);
  if (header == Header::kHash && !csv.text_.starts_with('#')) {
    faults.add(file, 1, "no header that begins with '#'");
    return csv;
  }
  csv.header_size_ = std::min(csv.text_.find('\n'), csv.text_.size());
  csv.position_ = std::min(csv.header_size_ + 1, csv.text_.size());
  csv.line_ = 1;
  return csv;
}

std::string_view CsvFile::header() const {
  return trimmed(std::string_view(text_).substr(0, header_size_));
}

bool CsvFile::next(DatasetFaults& faults) {
  while (position_ < text_.size()) {
    ++line_;
    const std::size_t end = text_.find('\n', position_);
    if (end == std::string::npos) {
      position_ = text_.size();
      faults.add(path_, line_, "cut-off last line");
      return false;
    }
    const std::string_view row(text_.data() + position_, end - position_);
    position_ = end + 1;
    if (trimmed(row).empty()) continue;
    const std::size_t found = split(row);
    if (found == columns_) return true;
    faults.add(path_, line_, "wrong number of columns",
               fmt::format("{} instead of {}", found, columns_));
  }
  return false;
}

std::size_t CsvFile::split(std::string_view row) {
  std::size_t count = 0;
  for (;;) {
    const std::size_t comma = row.find(',');
    if (count < fields_.size()) fields_.at(count) = trimmed(row.substr(0, comma));
    ++count;
    if (comma == std::string_view::npos) return count;
    row.remove_prefix(comma + 1);
  }
}

void CsvFile::refuse(std::string_view wrong, std::size_t column, DatasetFaults& faults) const {
  constexpr std::size_t kShown = 40;  // enough to recognize a field, too short to flood a log
  faults.add(path_, line_, wrong,
             fmt::format("column {} is '{}'", column + 1, field(column).substr(0, kShown)));
}

}  // namespace crepes
