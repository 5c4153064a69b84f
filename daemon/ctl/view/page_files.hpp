/// The files of the page, which CMake compiles in from view/page.
#pragma once

#include <string_view>

namespace crepes {

/// A file of the page, compiled into the program.
struct PageFile {
  std::string_view path;  ///< as a browser asks for it
  std::string_view type;
  std::string_view text;
};

/// "/" is index.html. Null for anything else than a file of the page.
[[nodiscard]] const PageFile* page_file(std::string_view path);

}  // namespace crepes
