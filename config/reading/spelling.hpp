/// Which known word a misspelled one was meant to be.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace crepes {

/// The candidate with the fewest letters to insert, delete or replace; the first of several. Empty
/// if none is similar: more than one edit and one more for every three letters of `word`.
[[nodiscard]] std::optional<std::string> nearest_spelling(std::string_view word,
                                                          std::span<const std::string> candidates);

}  // namespace crepes
