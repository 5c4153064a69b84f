/// What `--json` puts on standard output: objects, each in a line of its own, and nothing else.
/// What goes on meanwhile and what is refused goes to standard error; so does an error, in words,
/// and the exit code tells of it. For the files that write such lines alone.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace crepes {

/// Never throws: what is not UTF-8, as a file's name may be, is mended.
[[nodiscard]] std::string json_line(const nlohmann::ordered_json& json);

/// Unknown values are left out.
void put_finite(nlohmann::ordered_json& object, const char* key, double value);

}  // namespace crepes
