/// Runs a function in a copy of this process, so that its changes and its crashes stay there.
#pragma once

#include <functional>
#include <string>

namespace crepes::faults {

struct ChildResult {
  std::string text;   ///< what the function returned
  std::string crash;  ///< how the copy died; empty if it did not
};

/// For programs without threads.
[[nodiscard]] ChildResult in_child(const std::function<std::string()>& function);

}  // namespace crepes::faults
