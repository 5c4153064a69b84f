#include "drivers/imu/mavlink.hpp"

#include <algorithm>
#include <array>
#include <chrono>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kVersion1 = 0xfe;
constexpr std::uint8_t kVersion2 = 0xfd;
constexpr std::size_t kChecksum = 2;
constexpr std::size_t kSignature = 13;
constexpr double kMilliGravity = 1e-3 * kGravityMps2;

enum MessageId : std::uint32_t {
  kHeartbeat = 0,
  kSysStatus = 1,
  kScaledImu = 26,
  kRawImu = 27,
  kAttitude = 30,
  kHighresImu = 105,
  kTimesync = 111,
  kScaledImu2 = 116,
  kScaledImu3 = 129,
};

/// `length` in version 1; version 2 adds fields up to `extended` and omits trailing zeros.
struct Message {
  MessageId id;
  std::size_t length;
  std::size_t extended;
  std::uint8_t crc_extra;
};

constexpr std::array kMessages{Message{kHighresImu, 62, 63, 93}, Message{kScaledImu, 22, 24, 170},
                               Message{kScaledImu2, 22, 24, 76}, Message{kScaledImu3, 22, 24, 46},
                               Message{kRawImu, 26, 29, 144},    Message{kHeartbeat, 9, 9, 50},
                               Message{kSysStatus, 31, 43, 124}, Message{kAttitude, 28, 28, 39},
                               Message{kTimesync, 16, 18, 34}};

struct Header {
  std::uint32_t id = 0;
  std::size_t size = 0;  ///< of the header itself
  std::size_t payload = 0;
  bool is_signed = false;
  std::uint32_t sender = 0;  ///< system and component

  [[nodiscard]] std::size_t frame() const {
    return size + payload + kChecksum + (is_signed ? kSignature : 0);
  }
};

std::size_t header_size(Bytes bytes) { return bytes[0] == kVersion1 ? 6 : 10; }

Header header_of(Bytes bytes) {
  if (bytes[0] == kVersion1) {
    return {.id = bytes[5],
            .size = 6,
            .payload = bytes[1],
            .sender = static_cast<std::uint32_t>(unsigned_at(bytes, 3, 2))};
  }
  return {.id = static_cast<std::uint32_t>(unsigned_at(bytes, 7, 3)),
          .size = 10,
          .payload = bytes[1],
          .is_signed = (bytes[2] & 1U) != 0,
          .sender = static_cast<std::uint32_t>(unsigned_at(bytes, 5, 2))};
}

/// CRC-16/MCRF4XX, least significant bit first.
std::uint16_t crc_of(Bytes bytes, std::uint8_t extra) {
  std::uint32_t crc = 0xffffU;
  const auto add = [&](std::uint8_t byte) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1U ^ 0x8408U : crc >> 1U;
  };
  std::ranges::for_each(bytes, add);
  add(extra);
  return static_cast<std::uint16_t>(crc);
}

const Message* message_of(std::uint32_t id) {
  const auto* const found =
      std::ranges::find_if(kMessages, [&](const Message& m) { return m.id == id; });
  return found == kMessages.end() ? nullptr : found;
}

bool can_have(const Message& message, Bytes bytes, std::size_t length) {
  return bytes[0] == kVersion1 ? length == message.length
                               : length >= 1 && length <= message.extended;
}

/// From forward, right, down to forward, left, up.
Eigen::Vector3d turned(const Eigen::Vector3d& v) { return {v.x(), -v.y(), -v.z()}; }

/// Integers whose extreme values mean saturation.
bool is_saturated(const Eigen::Vector3d& raw) {
  return raw.minCoeff() <= -0x8000 || raw.maxCoeff() >= 0x7fff;
}

ImuReading highres(Bytes payload) {
  constexpr std::uint32_t kAllSix = 0x3fU;  // of the field that lists updated values
  if ((unsigned_at(payload, 60, 2) & kAllSix) != kAllSix) return {.verdict = ImuVerdict::kPartial};
  constexpr std::uint64_t kMicrosecond = 1000;  // ns
  return {.verdict = ImuVerdict::kSample,
          .gyro_radps = turned(vector_at<float>(payload, 20)),
          .accel_mps2 = turned(vector_at<float>(payload, 8)),
          .time = DeviceTime{.ns = unsigned_at(payload, 0, 8) * kMicrosecond}};
}

/// Acceleration in mG and rate in mrad/s.
ImuReading scaled_triads(Bytes payload, std::size_t accel_at, std::size_t gyro_at) {
  const Eigen::Vector3d accel = vector_at<std::int16_t>(payload, accel_at);
  const Eigen::Vector3d gyro = vector_at<std::int16_t>(payload, gyro_at);
  const bool saturated = is_saturated(accel) || is_saturated(gyro);
  return {.verdict = saturated ? ImuVerdict::kSaturated : ImuVerdict::kSample,
          .gyro_radps = turned(gyro) * 1e-3,
          .accel_mps2 = turned(accel) * kMilliGravity};
}

ImuReading scaled(Bytes payload) {
  ImuReading reading = scaled_triads(payload, 4, 10);
  reading.time = DeviceTime::ticks(unsigned_at(payload, 0, 4), std::chrono::milliseconds{1}, 32);
  return reading;
}

/// RAW_IMU of ArduPilot. Only the first sensor has this scale; `id` is an extension, 0 if omitted.
ImuReading ardupilot_raw(Bytes payload) {
  constexpr std::size_t kAccel = 8;
  constexpr std::size_t kGyro = 14;
  constexpr std::size_t kId = 26;
  constexpr std::uint64_t kMicrosecond = 1000;  // ns
  if (payload[kId] != 0) return {.verdict = ImuVerdict::kUnscaled};
  ImuReading reading = scaled_triads(payload, kAccel, kGyro);
  reading.time = DeviceTime{.ns = unsigned_at(payload, 0, 8) * kMicrosecond};
  return reading;
}

/// Smaller is better; empty: the message holds no samples.
std::optional<int> rank_of(std::uint32_t id) {
  constexpr std::array kBestFirst{kHighresImu, kScaledImu, kRawImu, kScaledImu2, kScaledImu3};
  const auto* const found = std::ranges::find(kBestFirst, id);
  if (found == kBestFirst.end()) return std::nullopt;
  return static_cast<int>(found - kBestFirst.begin());
}

bool is_start(std::uint8_t byte) { return byte == kVersion1 || byte == kVersion2; }

/// A message without a known checksum counts only if another one begins where it ends.
FrameCheck examine_unknown(Bytes bytes, const Header& header) {
  if (bytes.size() <= header.frame()) return {FrameKind::kIncomplete};
  if (!is_start(bytes[header.frame()])) return {};
  return {FrameKind::kUnchecked, header.frame()};
}

std::uint8_t system_of(Bytes frame) { return frame[frame[0] == kVersion1 ? 3 : 5]; }

}  // namespace

FrameCheck Mavlink::examine(Bytes bytes) {
  if (!is_start(bytes[0])) return {};
  if (bytes.size() < header_size(bytes)) return {FrameKind::kIncomplete};
  const Header header = header_of(bytes);
  if (bytes[0] == kVersion2 && (bytes[2] & ~1U) != 0)
    return {};  // incompatible flags: must be refused if unknown
  const Message* message = message_of(header.id);
  if (message == nullptr) return examine_unknown(bytes, header);
  if (!can_have(*message, bytes, header.payload)) return {};
  if (bytes.size() < header.frame()) return {FrameKind::kIncomplete};
  const std::size_t end = header.size + header.payload;
  if (crc_of(bytes.subspan(1, end - 1), message->crc_extra) != unsigned_at(bytes, end, kChecksum))
    return {FrameKind::kBadChecksum};
  return {FrameKind::kComplete, header.frame()};
}

ImuReading Mavlink::read(Bytes frame, bool is_ardupilot) {
  const Header header = header_of(frame);
  std::array<std::uint8_t, 255> payload{};  // restores omitted zeros
  std::ranges::copy(frame.subspan(header.size, header.payload), payload.begin());
  switch (header.id) {
    case kHighresImu:
      return highres(payload);
    case kScaledImu:
    case kScaledImu2:
    case kScaledImu3:
      return scaled(payload);
    case kRawImu:
      return is_ardupilot ? ardupilot_raw(payload) : ImuReading{.verdict = ImuVerdict::kUnscaled};
    default:
      return {};
  }
}

bool MavlinkParser::is_chosen(Bytes frame, Timestamp arrival) {
  constexpr Duration kGone = std::chrono::seconds(1);
  const Header header = header_of(frame);
  const std::optional<int> rank = rank_of(header.id);
  const bool is_unscaled = header.id == kRawImu && !is_ardupilot(frame);
  if (!rank || is_unscaled) return true;  // no sample: only counted
  const bool is_same = source_ && *rank == source_->rank && header.sender == source_->sender;
  const bool is_better = !source_ || *rank < source_->rank || arrival - source_->heard > kGone;
  if (!is_same && !is_better) return false;
  if (!is_same) clock_.change_clock();  // each sender's runs since it was switched on
  source_ = Source{*rank, header.sender, arrival};
  return true;
}

bool MavlinkParser::is_ardupilot(Bytes frame) const {
  return ardupilots_.contains(system_of(frame));
}

void MavlinkParser::parse(Bytes frame, Timestamp arrival,
                          const std::function<void(const ImuSample&)>& sink) {
  constexpr std::size_t kAutopilot = 5;       // of the payload of HEARTBEAT
  constexpr std::uint8_t kArduPilotMega = 3;  // MAV_AUTOPILOT_ARDUPILOTMEGA
  const Header header = header_of(frame);
  const bool has_autopilot = header.id == kHeartbeat && header.payload > kAutopilot;
  if (has_autopilot && frame[header.size + kAutopilot] == kArduPilotMega)
    ardupilots_.insert(system_of(frame));
  if (is_chosen(frame, arrival))
    forward_sample(Mavlink::read(frame, is_ardupilot(frame)), arrival, clock_, counts_, sink);
}

std::string MavlinkParser::no_measurement_reason() const {
  return std::string(counts_.unscaled > 0 ? Mavlink::kOnlyRaw : Mavlink::kNoSamples);
}

}  // namespace crepes
