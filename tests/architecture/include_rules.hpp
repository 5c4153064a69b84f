/// Who may include whom, and which words stay in which files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// What is wrong with one source file: `path:line: reason` each. `path` is relative to the root.
[[nodiscard]] std::vector<std::string> violations_in(std::string_view path, std::string_view text);

}  // namespace crepes
