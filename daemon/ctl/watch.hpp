/// crepesctl watch and status: what a running daemon says.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "estimator/core/result.hpp"

namespace crepes {

struct WatchOptions {
  std::string address = "127.0.0.1";
  std::uint16_t port = 47475;
  std::optional<double> for_s;  ///< stop after so long; else when told to
  bool once = false;            ///< one table, then stop
  bool json = false;            ///< the daemon's objects as they come, one a line
};

/// Shows poses until it is stopped. A daemon that never answers is an error.
[[nodiscard]] Result<void> watch(const WatchOptions& options);

/// Asks once, prints the answer.
[[nodiscard]] Result<void> print_status(const WatchOptions& options);

}  // namespace crepes
