/// The output of `--json`: objects on standard output, one a line, and nothing else. Progress,
/// refused input and error messages go to standard error; the exit code reports success.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace crepes {

/// Never throws. Text that is not UTF-8, as a file name may be, is repaired.
[[nodiscard]] std::string json_line(const nlohmann::ordered_json& json);

/// Adds `value` if it is finite.
void put_finite(nlohmann::ordered_json& object, const char* key, double value);

}  // namespace crepes
