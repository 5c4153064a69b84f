#include "drivers/iio/scan_format.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "tests/support/fake_iio.hpp"

namespace crepes::scan_format_test {
namespace {

TEST(ScanFormat, ReadsTypesAsTheKernelWritesThem) {
  EXPECT_EQ(parse_scan_element("le:s16/16>>0"), ScanElement());
  EXPECT_EQ(parse_scan_element("be:u12/16>>4"), (ScanElement{std::endian::big, false, 12, 16, 4}));
  EXPECT_EQ(parse_scan_element("le:s64/64>>0"),
            (ScanElement{std::endian::little, true, 64, 64, 0}));
  EXPECT_EQ(parse_scan_element("be:s24/32"), (ScanElement{std::endian::big, true, 24, 32, 0}));
}

TEST(ScanFormat, RefusesUnknownTypesByName) {
  for (const char* text : {"", "s16/16>>0", "le:f32/32>>0", "le:s16/16X2>>0", "le:s16/15>>0",
                           "le:s0/16>>0", "le:s17/16>>0", "le:s16/16>>1", "le:s16", "le:s16/16>>",
                           "le:s16/16>>0 ", "le:s-1/16>>0", "xe:s16/16>>0"}) {
    const auto element = parse_scan_element(text);
    ASSERT_FALSE(element) << text;
    EXPECT_EQ(element.error().code, ErrorCode::kFormat);
    EXPECT_NE(element.error().message.find(text), std::string::npos) << element.error().message;
  }
}

TEST(ScanFormat, AlignsEachElementToItsOwnSize) {
  const ScanElement byte{std::endian::little, true, 8, 8, 0};
  const ScanElement word{std::endian::big, true, 32, 32, 0};
  const ScanElement stamp{std::endian::little, true, 64, 64, 0};
  const ScanLayout layout({byte, word, byte, stamp, byte});

  ASSERT_EQ(layout.size(), 32U);
  std::vector<std::uint8_t> scan(32, 0xee);
  scan[0] = 0xff;
  scan[4] = 0x01, scan[5] = 0x02, scan[6] = 0x03, scan[7] = 0x04;
  scan[8] = 0x7f;
  for (std::size_t i = 16; i < 24; ++i) scan[i] = static_cast<std::uint8_t>(i - 15);
  scan[24] = 0x80;
  EXPECT_EQ(layout.value(scan, 0), -1);
  EXPECT_EQ(layout.value(scan, 1), 0x01020304);
  EXPECT_EQ(layout.value(scan, 2), 127);
  EXPECT_EQ(layout.value(scan, 3), 0x0807060504030201);
  EXPECT_EQ(layout.value(scan, 4), -128);
}

TEST(ScanFormat, ShiftsAndExtendsTheSignOfEveryWidth) {
  EXPECT_TRUE(rc::check([] {
    const unsigned storage = 8U << *rc::gen::inRange(0U, 4U);
    const unsigned bits = *rc::gen::inRange(1U, storage + 1);
    const unsigned shift = *rc::gen::inRange(0U, storage - bits + 1);
    const bool is_signed = bits < 64 ? *rc::gen::arbitrary<bool>() : true;
    const auto order = *rc::gen::element(std::endian::big, std::endian::little);
    const auto any = *rc::gen::arbitrary<std::int64_t>();
    // The value that fits: the low bits of any number, with its sign or without.
    const auto unused = 64 - bits;
    const auto high = static_cast<std::uint64_t>(any) << unused;
    const std::int64_t value = is_signed ? static_cast<std::int64_t>(high) >> unused
                                         : static_cast<std::int64_t>(high >> unused);
    // What else is in the storage must not matter.
    const std::uint64_t mask = (bits == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1);
    const auto noise = *rc::gen::arbitrary<std::uint64_t>();
    const std::uint64_t stored =
        (noise & ~(mask << shift)) | (static_cast<std::uint64_t>(value) & mask) << shift;

    ScanBytes scan(order);
    scan.add(static_cast<std::int64_t>(stored), storage / 8);
    const ScanLayout layout({ScanElement{order, is_signed, bits, storage, shift}});
    RC_ASSERT(layout.value(scan.bytes(), 0) == value);
  }));
}

}  // namespace
}  // namespace crepes::scan_format_test
