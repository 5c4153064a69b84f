/// Text for a terminal: colors, columns, lines that are wrapped or cut. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// The reader of a screen.
struct ScreenFormat {
  std::size_t columns = 120;    ///< a file has no edge: enough for every column
  bool is_interactive = false;  ///< keys are read: the screen names them
  bool has_color = false;
};

/// What a piece of text says besides its words, which say it too.
enum class Tone : std::uint8_t { kTitle, kDim, kGood, kNotice, kBad };

/// With the color of `tone` if the reader sees colors; the color-blind can distinguish them.
[[nodiscard]] std::string toned(const std::string& text, Tone tone, const ScreenFormat& format);

/// The columns that a text takes: colors take none, a letter of several bytes (UTF-8) takes one.
[[nodiscard]] std::size_t columns_of(std::string_view text);

/// The beginning of a line that takes at most `columns`; colors in it end.
[[nodiscard]] std::string cut(std::string_view line, std::size_t columns);

/// Lines of at most `columns`, broken at blanks; all but the first are indented. A word that is
/// longer than a line is broken. `begun` columns of the first line are taken already.
[[nodiscard]] std::string wrapped(std::string_view text, std::size_t columns, std::size_t indent,
                                  std::size_t begun = 0);

/// A column with a fixed width, so that the text beside it does not move.
struct ScreenColumn {
  std::string title;
  std::size_t width;  ///< with the blank before it
};

/// One line of cells, the first flush left, all others right. Cells that are too wide are cut;
/// cells may have colors.
[[nodiscard]] std::string screen_row(const std::vector<ScreenColumn>& columns,
                                     const std::vector<std::string>& cells);
/// The titles of the columns.
[[nodiscard]] std::string screen_titles(const std::vector<ScreenColumn>& columns,
                                        const ScreenFormat& format);

/// `value` with at most `decimals` decimals: as many as fit `width`.
[[nodiscard]] std::string fitted(double value, int decimals, std::size_t width);

/// A mode of a pose, or "none", in its color.
[[nodiscard]] std::string toned_mode(std::string_view mode, const ScreenFormat& format);

}  // namespace crepes
