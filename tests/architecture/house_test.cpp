#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/architecture/source_tree.hpp"
#include "tests/support/places.hpp"

namespace crepes::house_test {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWidth = 100;  // columns

std::size_t columns_of(std::string_view utf8) {
  return static_cast<std::size_t>(std::ranges::count_if(
      utf8, [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

/// Tables, headings and HTML cannot be wrapped, and neither can a link.
bool can_be_wrapped(const std::string& line) {
  const std::size_t start = line.find_first_not_of(' ');
  if (start == std::string::npos || std::string_view("|#<").find(line[start]) != std::string::npos)
    return false;
  return line.find("](") == std::string::npos && line.find("://") == std::string::npos;
}

/// The numbers of the lines of prose that are wider than the limit. Code blocks are no prose.
std::vector<int> wide_lines(const std::string& markdown) {
  std::vector<int> wide;
  std::istringstream lines(markdown);
  std::string line;
  bool is_code = false;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t start = line.find_first_not_of(' ');
    if (start != std::string::npos && line.compare(start, 3, "```") == 0) is_code = !is_code;
    if (!is_code && can_be_wrapped(line) && columns_of(line) > kWidth) wide.push_back(number);
  }
  return wide;
}

std::vector<fs::path> markdown_files() {
  const fs::path root = source_dir();
  std::vector<fs::path> files;
  const auto add = [&](const fs::directory_entry& entry) {
    if (entry.path().extension() == ".md") files.push_back(entry.path());
  };
  for (const auto& entry : fs::directory_iterator(root)) add(entry);
  for (const char* folder :
       {"config", "daemon", "drivers", "estimator", "firmware", "net", "systemd", "tests"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) add(entry);
  }
  return files;
}

TEST(Documents, FindWideProseAndNothingElse) {
  const std::string wide(101, 'x');
  const std::string code = "```sh\n" + wide + "\n```\n";

  EXPECT_EQ(wide_lines(std::string(100, 'x') + "\n" + wide + "\n"), std::vector<int>{2});
  EXPECT_EQ(wide_lines(code + wide), std::vector<int>{4});
  EXPECT_TRUE(wide_lines("| " + wide + "\n# " + wide + "\n[x](" + wide + ")\n").empty());
  EXPECT_EQ(columns_of("25 µs²"), 6U);
}

TEST(Documents, WrapTheirProse) {
  const std::vector<fs::path> files = markdown_files();

  EXPECT_GT(files.size(), 50U);
  for (const fs::path& file : files) {
    for (const int line : wide_lines(text_of_file(file)))
      ADD_FAILURE() << file << ":" << line << " is wider than " << kWidth << " columns";
  }
}

TEST(Folders, HaveFewConceptsOnOneLevel) {
  constexpr std::size_t kMost = 28;  // about 25 pairs of a header and its source
  std::map<fs::path, std::set<fs::path>> concepts;
  for (const fs::path file :
       source_files({"config", "daemon", "drivers", "estimator", "firmware", "net"}))
    concepts[file.parent_path()].insert(file.stem());

  EXPECT_GT(concepts.size(), 30U);
  for (const auto& [folder, files] : concepts) EXPECT_LE(files.size(), kMost) << folder;
}

/// Tests of one program are compiled together, and repeat short names.
TEST(Folders, HaveTestsInNamespacesCalledLikeTheirFiles) {
  int tests = 0;
  for (const std::string& file : source_files({"tests"})) {
    const std::string stem = fs::path(file).stem();
    if (!stem.ends_with("_test")) continue;
    ++tests;
    EXPECT_NE(text_of_file(fs::path(source_dir()) / file).find("::" + stem + " {\nnamespace {\n"),
              std::string::npos)
        << file << " needs: namespace crepes::" << stem << " {";
  }
  EXPECT_GT(tests, 200);
}

TEST(Documents, NameTheReleaseOfTheProject) {
  const fs::path root = source_dir();
  std::smatch found;
  const std::string project = text_of_file(root / "CMakeLists.txt");
  ASSERT_TRUE(std::regex_search(project, found, std::regex(R"(project\(crepes VERSION (\S+))")));
  const std::string release = found[1];

  struct Copy {
    const char* file;
    std::regex pattern;
  };
  for (const Copy& copy : std::array{
           Copy{"CHANGELOG.md", std::regex(R"(\n## (\d\S*))")},
           Copy{"config/examples/clients/python/setup.cfg", std::regex(R"(\nversion = (\S+))")},
           Copy{"config/examples/clients/ros2/package.xml", std::regex("<version>([^<]+)<")},
           Copy{"config/examples/clients/ros2/setup.py", std::regex("version=\"([^\"]+)\"")}}) {
    const std::string text = text_of_file(root / copy.file);
    ASSERT_TRUE(std::regex_search(text, found, copy.pattern)) << copy.file;
    EXPECT_EQ(found[1], release) << copy.file;
  }
}

}  // namespace
}  // namespace crepes::house_test
