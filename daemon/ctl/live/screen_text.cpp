#include "daemon/ctl/live/screen_text.hpp"

#include <algorithm>

#include "daemon/ctl/text_table.hpp"

namespace crepes {
namespace {

constexpr char kEscape = '\x1b';
constexpr std::string_view kReset = "\x1b[0m";

std::string_view code_of(Tone tone) {
  switch (tone) {
    case Tone::kTitle:
      return "\x1b[1m";
    case Tone::kDim:
      return "\x1b[2m";
    case Tone::kGood:
      return "\x1b[36m";  // cyan, yellow and bold red differ in brightness, too
    case Tone::kNotice:
      return "\x1b[33m";
    case Tone::kBad:
      return "\x1b[1;31m";
  }
  return "";
}

/// The bytes at the beginning of `text` that stay together: a color, or a letter.
std::size_t length_of_first(std::string_view text) {
  const bool is_color = text.front() == kEscape;
  const auto is_end = [&](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return is_color ? c == 'm' : (byte & 0xC0U) != 0x80U;
  };
  const auto* const end = std::find_if(text.begin() + 1, text.end(), is_end);
  const auto length = static_cast<std::size_t>(end - text.begin());
  return is_color && end != text.end() ? length + 1 : length;
}

}  // namespace

std::string toned(const std::string& text, Tone tone, const ScreenFormat& format) {
  if (!format.has_color || text.empty()) return text;
  return std::string(code_of(tone)) + text + std::string(kReset);
}

std::size_t columns_of(std::string_view text) {
  std::size_t columns = 0;
  while (!text.empty()) {
    if (text.front() != kEscape) ++columns;
    text.remove_prefix(length_of_first(text));
  }
  return columns;
}

std::string cut(std::string_view line, std::size_t columns) {
  std::string kept;
  bool is_colored = false;
  while (!line.empty() && (columns > 0 || line.front() == kEscape)) {
    const std::string_view piece = line.substr(0, length_of_first(line));
    const bool is_color = piece.front() == kEscape;
    if (is_color) is_colored = piece != kReset;
    if (!is_color) --columns;
    kept += piece;
    line.remove_prefix(piece.size());
  }
  return is_colored ? kept + std::string(kReset) : kept;
}

std::string wrapped(std::string_view text, std::size_t columns, std::size_t indent,
                    std::size_t begun) {
  std::string lines;
  std::size_t used = begun;
  bool is_first_word = true;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    std::string word(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!word.empty()) {
      const std::size_t blank = is_first_word ? 0 : 1;
      if (used + blank + columns_of(word) <= columns) {
        lines += std::string(blank, ' ') + word;
        used += blank + columns_of(word);
        is_first_word = false;
        break;
      }
      if (is_first_word && used <= indent) {  // longer than a whole line
        const std::string part =
            cut(word, std::max<std::size_t>(1, columns - std::min(columns, used)));
        lines += part;
        word.erase(0, part.size());
      }
      lines += "\n" + std::string(indent, ' ');
      used = indent;
      is_first_word = true;
    }
  }
  return lines;
}

std::string screen_row(const std::vector<ScreenColumn>& columns,
                       const std::vector<std::string>& cells) {
  std::string line;
  for (std::size_t i = 0; i < std::min(columns.size(), cells.size()); ++i) {
    const std::string cell = cut(cells[i], columns[i].width - (i == 0 ? 0 : 1));
    const std::string padding(columns[i].width - columns_of(cell), ' ');
    line += i == 0 ? cell + padding : padding + cell;
  }
  return line;
}

std::string screen_titles(const std::vector<ScreenColumn>& columns, const ScreenFormat& format) {
  std::vector<std::string> titles;
  titles.reserve(columns.size());
  for (const ScreenColumn& column : columns) titles.push_back(column.title);
  return toned(screen_row(columns, titles), Tone::kTitle, format);
}

std::string fitted(double value, int decimals, std::size_t width) {
  std::string text = fixed(value, decimals);
  while (text.size() > width && decimals > 0) text = fixed(value, --decimals);
  return text;
}

std::string toned_mode(std::string_view mode, const ScreenFormat& format) {
  const std::string text(mode);
  if (mode == "direct" || mode == "graph") return toned(text, Tone::kGood, format);
  return toned(text, mode == "predicted" ? Tone::kNotice : Tone::kBad, format);
}

}  // namespace crepes
