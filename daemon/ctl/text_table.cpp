#include "daemon/ctl/text_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace crepes {
namespace {

/// `words`, with further lines that begin below its first letter.
std::string wrapped(std::string_view words, std::size_t column) {
  constexpr std::size_t kWidth = 100;
  constexpr std::size_t kLeast = 24;
  const std::size_t width = std::max(kWidth - std::min(column, kWidth), kLeast);
  std::string text;
  while (words.size() > width) {
    const std::size_t space = std::min(words.rfind(' ', width), words.find(' ', width));
    if (space == std::string_view::npos) break;
    text += words.substr(0, space);
    text += '\n' + std::string(column, ' ');
    words.remove_prefix(space + 1);
  }
  return text.append(words);
}

}  // namespace

std::string text_table(const std::vector<std::vector<std::string>>& rows, LastColumn last) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()), 0);
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::size_t column = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string padding(widths[i] - row[i].size(), ' ');
      if (i > 0) text += "  ";
      if (i > 0 && i + 1 == widths.size() && last == LastColumn::kWords) {
        text += wrapped(row[i], column);
      } else {
        text += i == 0 ? row[i] + padding : padding + row[i];
      }
      column += widths[i] + 2;
    }
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  return text;
}

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::array<char, 64> buffer{};
  const int length = std::snprintf(buffer.data(), buffer.size(), "%.*f", decimals, value);
  if (length <= 0 || static_cast<std::size_t>(length) >= buffer.size()) return "-";
  const std::string_view text(buffer.data());
  const bool is_minus_zero =
      text.starts_with('-') && text.find_first_of("123456789") == std::string_view::npos;
  return std::string(text.substr(is_minus_zero ? 1 : 0));
}

}  // namespace crepes
