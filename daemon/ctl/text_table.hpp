/// Tables with aligned columns, for a terminal.
#pragma once

#include <string>
#include <vector>

namespace crepes {

/// What the last column of a table has: words are flush left, and wrap at 100 columns.
enum class LastColumn : bool { kNumbers, kWords };

/// Rows of cells; the first row is the header. The first column is flush left, all others right.
[[nodiscard]] std::string text_table(const std::vector<std::vector<std::string>>& rows,
                                     LastColumn last = LastColumn::kNumbers);

/// `value` with `decimals` decimals; zero has no sign; "-" if it is not finite.
[[nodiscard]] std::string fixed(double value, int decimals);

}  // namespace crepes
