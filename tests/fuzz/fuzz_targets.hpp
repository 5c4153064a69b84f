/// All code that receives external bytes, and what must hold for any bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace crepes {

using FuzzInput = std::vector<std::uint8_t>;

struct FuzzTarget {
  std::string_view name;
  void (*run)(std::span<const std::uint8_t>);  ///< aborts when something does not hold
  std::vector<FuzzInput> (*seeds)();           ///< valid inputs to begin with
  std::size_t cost = 1;                        ///< the quick suite runs so many times fewer inputs
};

[[nodiscard]] std::span<const FuzzTarget> fuzz_targets();
/// Aborts when there is no such target.
[[nodiscard]] const FuzzTarget& fuzz_target(std::string_view name);

[[nodiscard]] std::string hex_of(std::span<const std::uint8_t> input);
/// One input a line.
[[nodiscard]] std::vector<FuzzInput> read_hex_lines(const std::string& file_name);
/// Inputs kept from earlier runs, in corpus/NAME.hex: one a line.
[[nodiscard]] std::vector<FuzzInput> kept_inputs(std::string_view target);
void keep_inputs(std::string_view target, std::vector<FuzzInput> inputs);

}  // namespace crepes
