/// fuzz_corpus unpack TARGET DIR: seeds and kept inputs as libFuzzer wants them, a file each.
/// fuzz_corpus pack TARGET DIR: keeps the files in DIR, but for long ones.
/// fuzz_corpus run TARGET FILE: runs the inputs of a file, one a line in hexadecimal, in order.
/// fuzz_corpus list: the names of all targets.
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
  const std::string command = count > 1 ? words[1] : "";
  if (count == 2 && command == "list") {
    for (const crepes::FuzzTarget& target : crepes::fuzz_targets())
      std::cout << target.name << '\n';
  } else if (count == 4 && command == "pack") {
    crepes::pack(crepes::fuzz_target(words[2]), words[3]);
  } else if (count == 4 && command == "unpack") {
    crepes::unpack(crepes::fuzz_target(words[2]), words[3]);
  } else if (count == 4 && command == "run") {
    for (const auto& input : crepes::read_hex_lines(words[3]))
      crepes::fuzz_target(words[2]).run(input);
  } else {
    std::cerr << "usage: fuzz_corpus list | pack|unpack TARGET DIR | run TARGET FILE\n";
    return 2;
  }
  return 0;
}
