#include "net/mesh/crc32.hpp"

#include <gtest/gtest.h>

#include <array>

namespace crepes::crc32_test {
namespace {

constexpr std::array<std::uint8_t, 9> kDigits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};

TEST(Crc32, IsThatOfTheStandardCheck) { EXPECT_EQ(crc32(kDigits), 0xCBF43926U); }

TEST(Crc32, GoesOnFromTheBytesBefore) {
  const std::span<const std::uint8_t> digits = kDigits;

  EXPECT_EQ(crc32(digits.subspan(4), crc32(digits.first(4))), crc32(kDigits));
}

}  // namespace
}  // namespace crepes::crc32_test
