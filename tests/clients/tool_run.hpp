/// crepesctl and other programs, as a script runs them.
#pragma once

#include <poll.h>

#include <sstream>
#include <string>
#include <vector>

#include "drivers/base/child_process.hpp"
#include "drivers/base/scratch_directory.hpp"
#include "drivers/base/text_file.hpp"
#include "tests/support/live_daemon.hpp"
#include "tests/support/places.hpp"

namespace crepes {

struct Ending {
  std::string how;     ///< "exit code 0"
  std::string output;  ///< standard output alone
  std::string errors;  ///< standard error
};

inline Ending run(const std::string& program, const std::vector<std::string>& arguments) {
  const ScratchDirectory scratch = ScratchDirectory::create({}).value();
  const auto output = scratch.path() / "output";
  const auto errors = scratch.path() / "errors";
  std::vector<std::string> words{"-c", R"(exec "$@" 2>")" + errors.string() + "\"", "sh", program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  auto child = ChildProcess::start("/bin/sh", words, output);
  if (!child) return {child.error().message, "", ""};
  const MonotonicClock clock;
  const Timestamp end = clock.now() + kPatience;
  while (!child->exit_reason() && clock.now() < end) ::poll(nullptr, 0, 20);
  return {child->exit_reason().value_or("still running"), read_text_file(output).value_or(""),
          read_text_file(errors).value_or("")};
}

inline Ending crepesctl(const std::vector<std::string>& arguments) {
  return run(crepesctl_path(), arguments);
}

/// Standard output as --json has it: every line an object. A failure where it is anything else.
inline std::vector<Json> objects_in(const Ending& ending) {
  std::vector<Json> objects;
  std::istringstream lines(ending.output);
  for (std::string line; std::getline(lines, line);) {
    objects.push_back(Json::parse(line, nullptr, /*allow_exceptions=*/false));
    EXPECT_TRUE(objects.back().is_object()) << line;
  }
  return objects;
}

/// The one object that a command prints; null and a failure if it is not just one, or the command
/// fails.
inline Json object_of(const std::vector<std::string>& arguments) {
  const Ending ending = crepesctl(arguments);
  EXPECT_EQ(ending.how, "exit code 0") << ending.errors;
  const std::vector<Json> objects = objects_in(ending);
  EXPECT_EQ(objects.size(), 1U) << arguments.front() << ": " << ending.output;
  return objects.size() == 1 ? objects.front() : Json();
}

}  // namespace crepes
