/// Which folder may include which, and which words only some files may contain.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace crepes {

/// The violations in one source file, each as `path:line: reason`. `path` is relative to the root.
[[nodiscard]] std::vector<std::string> violations_in(std::string_view path, std::string_view text);

/// Every folder (with a final slash) and every beginning of a file's path that a rule names.
[[nodiscard]] std::vector<std::string> paths_in_rules();

}  // namespace crepes
