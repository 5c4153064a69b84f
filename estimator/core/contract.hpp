/// Bugs in this program end it, in every build: one line on stderr, then abort.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace crepes::detail {

/// Prints the condition and the place on stderr, and aborts.
[[noreturn]] inline void contract_violated(const char* condition, const char* why, const char* file,
                                           int line) {
  std::fprintf(stderr, "%s:%d: contract violated: %s (%s)\n", file, line, why, condition);
  std::abort();
}

}  // namespace crepes::detail

/// A condition that only a programming error can break.
#define CREPES_EXPECT(condition, why) \
  ((condition) ? static_cast<void>(0) \
               : ::crepes::detail::contract_violated(#condition, why, __FILE__, __LINE__))
