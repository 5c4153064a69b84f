#include <gtest/gtest.h>

#include <filesystem>
#include <regex>
#include <string>

#include "tests/architecture/source_tree.hpp"
#include "tests/support/places.hpp"

namespace crepes::readme_test {
namespace {

namespace fs = std::filesystem;

/// The README of a file's folder, or of the nearest folder above that has one.
fs::path readme_of(const fs::path& file) {
  fs::path folder = file.parent_path();
  while (folder.has_parent_path() && !fs::exists(fs::path(source_dir()) / folder / "README.md"))
    folder = folder.parent_path();
  return folder / "README.md";
}

TEST(Readmes, NameEverySourceFileOfTheirFolder) {
  for (const fs::path file :
       source_files({"config", "daemon", "drivers", "estimator", "firmware", "net"})) {
    const fs::path readme = readme_of(file);
    const std::regex stem("\\b" + file.stem().string() + "\\b");
    EXPECT_TRUE(std::regex_search(text_of_file(fs::path(source_dir()) / readme), stem))
        << readme << " does not name " << file;
  }
}

}  // namespace
}  // namespace crepes::readme_test
