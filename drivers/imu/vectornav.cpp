#include "drivers/imu/vectornav.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>
#include <vector>

#include "drivers/base/number_text.hpp"
#include "drivers/serial/byte_fields.hpp"
#include "drivers/serial/text_line.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kVectorNavSync = 0xfa;
constexpr std::uint8_t kGroup1 = 0x01;
constexpr std::size_t kVectorNavFields = 2;
constexpr std::size_t kVectorNavPayload = 4;
constexpr std::size_t kVectorNavCrc = 2;

/// Group 1; the user manual UM001, section 4.4, and VectorNav's own libraries.
constexpr std::array<std::size_t, 15> kGroup1Sizes{8,  8,  8,  12, 16, 12, 24, 12,
                                                   12, 24, 20, 28, 2,  4,  8};
enum Group1Field : std::size_t { kTimeStartup = 0, kAngularRate = 5, kAccel = 8, kImu = 9 };

bool has_field(std::uint64_t fields, std::size_t field) { return (fields >> field & 1U) != 0; }

/// Position of a field; `kGroup1Sizes.size()` is that of the CRC.
std::size_t field_at_of(std::uint64_t fields, std::size_t field) {
  std::size_t at = kVectorNavPayload;
  for (std::size_t i = 0; i < field; ++i) at += has_field(fields, i) ? kGroup1Sizes.at(i) : 0;
  return at;
}

FrameCheck examine_binary(Bytes bytes) {
  if (bytes.size() >= 2 && bytes[1] != kGroup1) return {};
  if (bytes.size() < kVectorNavPayload) return {FrameKind::kIncomplete};
  const std::uint64_t fields = unsigned_at(bytes, kVectorNavFields, 2);
  if (fields == 0 || has_field(fields, kGroup1Sizes.size())) return {};
  const std::size_t length = field_at_of(fields, kGroup1Sizes.size()) + kVectorNavCrc;
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (crc16(bytes.subspan(1, length - 1)) != 0) return {FrameKind::kBadChecksum};
  return {FrameKind::kComplete, length};
}

ImuReading read_binary(Bytes frame) {
  const std::uint64_t fields = unsigned_at(frame, kVectorNavFields, 2);
  ImuReading reading{.verdict = ImuVerdict::kSample};
  if (has_field(fields, kImu)) {
    const std::size_t at = field_at_of(fields, kImu);
    reading.accel_mps2 = vector_at<float>(frame, at);
    reading.gyro_radps = vector_at<float>(frame, at + 12);
  } else if (has_field(fields, kAccel) && has_field(fields, kAngularRate)) {
    reading.accel_mps2 = vector_at<float>(frame, field_at_of(fields, kAccel));
    reading.gyro_radps = vector_at<float>(frame, field_at_of(fields, kAngularRate));
  } else {
    const bool is_half = has_field(fields, kAccel) || has_field(fields, kAngularRate);
    return {.verdict = is_half ? ImuVerdict::kPartial : ImuVerdict::kOther};
  }
  if (has_field(fields, kTimeStartup))
    reading.time = DeviceTime{.ns = unsigned_at(frame, field_at_of(fields, kTimeStartup), 8)};
  return reading;
}

/// The text between `$` and `*`, if the exclusive or of its characters is the number behind.
std::optional<std::string_view> checked_text(std::string_view line) {
  constexpr int kHex = 16;
  const std::size_t star = line.size() - std::min<std::size_t>(line.size(), 3);
  if (line.size() < 4 || line[star] != '*') return std::nullopt;
  unsigned stated = 0;
  const char* const end = line.data() + line.size();
  const auto [stop, status] = std::from_chars(line.data() + star + 1, end, stated, kHex);
  const std::string_view text = line.substr(1, star - 1);
  unsigned sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  if (status != std::errc{} || stop != end || stated != sum) return std::nullopt;
  return text;
}

ImuReading read_line(std::string_view line) {
  constexpr std::size_t kFirstAccel = 4;
  constexpr std::size_t kNumbers = 6;
  const std::optional<std::string_view> text = checked_text(line);
  if (!text || !text->starts_with("VNIMU,")) return {};
  const std::vector<std::string_view> parts = parts_of(*text, ',');
  if (parts.size() < kFirstAccel + kNumbers) return {};
  std::array<double, kNumbers> numbers{};
  for (std::size_t i = 0; i < kNumbers; ++i) {
    std::string_view part = parts[kFirstAccel + i];
    if (part.starts_with('+')) part.remove_prefix(1);
    if (!parse_number(part, numbers.at(i)).empty()) return {};
  }
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = {numbers[3], numbers[4], numbers[5]},
          .accel_mps2 = {numbers[0], numbers[1], numbers[2]}};
}

}  // namespace

FrameCheck VectorNav::examine(Bytes bytes) {
  if (bytes[0] == kVectorNavSync) return examine_binary(bytes);
  return examine_line(bytes, "$VN", kMaxFrame,
                      [](std::string_view line) { return checked_text(line).has_value(); });
}

ImuReading VectorNav::read(Bytes frame) {
  return frame[0] == kVectorNavSync ? read_binary(frame) : read_line(line_in(frame));
}

}  // namespace crepes
