/// The files of this repository, as the architecture tests read them.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>
#include <vector>

namespace crepes {

/// The C and C++ files below `folders`, sorted; paths relative to the root.
[[nodiscard]] std::vector<std::string> source_files(std::initializer_list<const char*> folders);

[[nodiscard]] std::string text_of_file(const std::filesystem::path& file);

}  // namespace crepes
