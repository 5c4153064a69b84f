/// One target under libFuzzer. CREPES_FUZZ_TARGET names it.
#include "tests/fuzz/fuzz_targets.hpp"

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const crepes::FuzzTarget& target = crepes::fuzz_target(CREPES_FUZZ_TARGET);
  target.run({data, size});
  return 0;
}
