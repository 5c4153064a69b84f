/// What a swarm with faults promises.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace crepes::faults {

enum class Promise : std::uint8_t {
  kRuns,      ///< no crash
  kProgram,   ///< what `Flight` checks at every step
  kFinite,    ///< poses are numbers, with covariances that are some and small enough
  kHonest,    ///< seconds beyond 5 sigma
  kNoGhosts,  ///< dishonest poses of a robot that is gone
  kPresent,   ///< seconds without a pose after the recovery
  kError,     ///< meters after the recovery, root mean square
  kTurn,      ///< degrees after the recovery, root mean square
};

inline constexpr std::array<std::string_view, 8> kPromiseNames{
    "runs", "program", "finite", "honest", "no-ghosts", "present", "error", "turn"};

[[nodiscard]] constexpr std::string_view name_of(Promise promise) {
  return kPromiseNames.at(static_cast<std::size_t>(promise));
}

[[nodiscard]] constexpr std::optional<Promise> promise_of(std::string_view name) {
  for (std::size_t i = 0; i < kPromiseNames.size(); ++i)
    if (kPromiseNames.at(i) == name) return static_cast<Promise>(i);
  return std::nullopt;
}

/// One that was not kept.
struct Broken {
  Promise promise{};
  double size = 0.0;  ///< how badly, in the unit of the promise
  std::string text;   ///< one line for people
};

}  // namespace crepes::faults
