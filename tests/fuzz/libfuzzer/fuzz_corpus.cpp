/// fuzz_corpus unpack TARGET DIR: seeds and kept inputs as libFuzzer wants them, a file each.
/// fuzz_corpus pack TARGET DIR: keeps the files in DIR, but for long ones.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>

#include "tests/fuzz/fuzz_targets.hpp"

namespace crepes {
namespace {

namespace fs = std::filesystem;

void unpack(const FuzzTarget& target, const fs::path& directory) {
  fs::create_directories(directory);
  std::vector<FuzzInput> inputs = target.seeds();
  for (FuzzInput& input : kept_inputs(target.name)) inputs.push_back(std::move(input));
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    std::ofstream file(directory / ("input" + std::to_string(i)), std::ios::binary);
    std::ranges::copy(inputs[i], std::ostreambuf_iterator<char>(file));
  }
}

void pack(const FuzzTarget& target, const fs::path& directory) {
  constexpr std::size_t kLongest = 300;
  std::vector<FuzzInput> inputs;
  for (const auto& entry : fs::directory_iterator(directory)) {
    std::ifstream file(entry.path(), std::ios::binary);
    FuzzInput input{std::istreambuf_iterator<char>(file), {}};
    if (input.size() <= kLongest) inputs.push_back(std::move(input));
  }
  keep_inputs(target.name, std::move(inputs));
}

}  // namespace
}  // namespace crepes

int main(int count, char** arguments) {
  const std::vector<std::string> words(arguments, arguments + count);
  if (words.size() != 4 || (words[1] != "pack" && words[1] != "unpack")) {
    std::cerr << "usage: fuzz_corpus pack|unpack TARGET DIR\n";
    return 2;
  }
  (words[1] == "pack" ? crepes::pack : crepes::unpack)(crepes::fuzz_target(words[2]), words[3]);
  return 0;
}
