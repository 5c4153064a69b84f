/// One target under libFuzzer: CREPES_FUZZ_TARGET in the environment names it.
#include <cstdlib>

#include "estimator/core/contract.hpp"
#include "tests/fuzz/fuzz_targets.hpp"

namespace crepes {
namespace {

const FuzzTarget& named_target() {
  const char* const name = std::getenv("CREPES_FUZZ_TARGET");  // NOLINT(concurrency-mt-unsafe)
  CREPES_EXPECT(name != nullptr, "CREPES_FUZZ_TARGET names a target");
  return fuzz_target(name);
}

}  // namespace
}  // namespace crepes

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const crepes::FuzzTarget& target = crepes::named_target();
  target.run({data, size});
  return 0;
}
