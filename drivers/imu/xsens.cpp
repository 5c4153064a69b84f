#include "drivers/imu/xsens.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "drivers/serial/byte_fields.hpp"
#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr std::uint8_t kMtData = 0x32;
constexpr std::uint8_t kMtData2 = 0x36;
constexpr std::uint8_t kMasterBus = 0xff;  ///< a sensor alone, or the master of a bus
constexpr std::uint8_t kLastBus = 0x14;    ///< at most 20 sensors are on a bus
constexpr std::size_t kItemHeader = 3;
constexpr std::uint32_t kPacketCounter = 0x1020;
constexpr std::uint32_t kSampleTimeFine = 0x1060;
constexpr std::uint32_t kDeltaV = 0x4010;
constexpr std::uint32_t kAccelerationId = 0x4020;
constexpr std::uint32_t kAccelerationHr = 0x4040;
constexpr std::uint32_t kRateOfTurn = 0x8020;
constexpr std::uint32_t kDeltaQ = 0x8030;
constexpr std::uint32_t kRateOfTurnHr = 0x8040;
constexpr std::uint32_t kStatusWord = 0xe020;
constexpr std::uint32_t kClipped = 0x3f00;  ///< of the status: any axis of either sensor

/// Position of the payload: a length of ff is followed by an extended length.
struct Extent {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Empty: too few bytes.
std::optional<Extent> extent_of(Bytes bytes) {
  if (bytes.size() < 4) return std::nullopt;
  if (bytes[3] != 0xff) return Extent{4, std::size_t{4} + bytes[3]};
  if (bytes.size() < 6) return std::nullopt;
  return Extent{6, 6 + unsigned_at(bytes, 4, 2, std::endian::big)};
}

/// Whether the items received so far can fill the payload.
bool items_can_fill(Bytes bytes, Extent payload) {
  std::size_t at = payload.begin;
  while (at + kItemHeader <= std::min(bytes.size(), payload.end)) at += kItemHeader + bytes[at + 2];
  const bool another_fits = at + kItemHeader <= payload.end;
  return at == payload.end || (another_fits && at + kItemHeader > bytes.size());
}

/// Numbers in the format given by the low two bits of the item's id; `Count` of them.
template <int Count>
std::optional<Eigen::Vector<double, Count>> xsens_numbers(Bytes data, std::uint32_t format) {
  constexpr auto kBig = std::endian::big;
  constexpr std::array<std::size_t, 4> kSizes{4, 4, 6, 8};
  const std::size_t size = kSizes.at(format);
  if (data.size() != Count * size) return std::nullopt;
  Eigen::Vector<double, Count> values;
  for (int i = 0; i < Count; ++i) {
    const std::size_t at = size * static_cast<std::size_t>(i);
    if (format == 0) values[i] = static_cast<double>(field_at<float>(data, at, kBig));
    if (format == 1) values[i] = field_at<std::int32_t>(data, at, kBig) / double{1U << 20U};
    if (format == 2) {  // 16.32, fraction first
      values[i] = field_at<std::int16_t>(data, at + 4, kBig) +
                  field_at<std::uint32_t>(data, at, kBig) / 4294967296.0;
    }
    if (format == 3) values[i] = field_at<double>(data, at, kBig);
  }
  return values;
}

using XsensTriad = std::optional<Eigen::Vector3d>;

/// The items that matter, by the number of their quantity.
struct XsensItems {
  std::array<XsensTriad, 3> accel;
  std::array<XsensTriad, 3> gyro;
  std::optional<DeviceTime> time;
  std::optional<std::uint16_t> counter;
  bool clipped = false;
};

/// The rotation of a quaternion w x y z; empty if its length is far from one.
XsensTriad rotation_of(Bytes data, std::uint32_t format) {
  const auto wxyz = xsens_numbers<4>(data, format);
  if (!wxyz || !(std::abs(wxyz->norm() - 1.0) < 0.01)) return std::nullopt;
  return so3_log(Eigen::Quaterniond((*wxyz)[0], (*wxyz)[1], (*wxyz)[2], (*wxyz)[3]).normalized());
}

/// Bits 2 and 3 of an id select the axes of orientations; these items are always in sensor axes.
void read_item(std::uint32_t id, Bytes data, XsensItems& items) {
  const std::uint32_t format = id & 3U;
  switch (id & 0xfff0U) {
    case kAccelerationId:
      items.accel[0] = xsens_numbers<3>(data, format);
      break;
    case kRateOfTurn:
      items.gyro[0] = xsens_numbers<3>(data, format);
      break;
    case kAccelerationHr:
      items.accel[1] = xsens_numbers<3>(data, format);
      break;
    case kRateOfTurnHr:
      items.gyro[1] = xsens_numbers<3>(data, format);
      break;
    case kDeltaV:
      items.accel[2] = xsens_numbers<3>(data, format);
      break;
    case kDeltaQ:
      items.gyro[2] = rotation_of(data, format);
      break;
    default:
      break;
  }
}

void read_time_or_status(std::uint32_t id, Bytes data, XsensItems& items) {
  if (id == kPacketCounter && data.size() == 2)
    items.counter = field_at<std::uint16_t>(data, 0, std::endian::big);
  if (data.size() != 4) return;
  const auto value = static_cast<std::uint32_t>(unsigned_at(data, 0, 4, std::endian::big));
  if (id == kSampleTimeFine) {
    items.time = DeviceTime::ticks(value, std::chrono::microseconds{100}, 32);
  } else if (id == kStatusWord) {
    items.clipped = (value & kClipped) != 0;
  }
}

XsensItems items_of(Bytes frame) {
  const Extent payload = extent_of(frame).value_or(Extent{});
  XsensItems items;
  for (std::size_t at = payload.begin; at < payload.end;) {
    const auto id = static_cast<std::uint32_t>(unsigned_at(frame, at, 2, std::endian::big));
    const Bytes data = frame.subspan(at + kItemHeader, frame[at + 2]);
    read_item(id, data, items);
    read_time_or_status(id, data, items);
    at += kItemHeader + data.size();
  }
  return items;
}

}  // namespace

FrameCheck Xsens::examine(Bytes bytes) {
  if (bytes[0] != 0xfa) return {};
  if (bytes.size() < 2) return {FrameKind::kIncomplete};
  if (bytes[1] != kMasterBus && (bytes[1] < 1 || bytes[1] > kLastBus)) return {};
  const std::optional<Extent> payload = extent_of(bytes);
  if (!payload) return {FrameKind::kIncomplete};
  const std::size_t length = payload->end + 1;
  if (length > kMaxFrame) return {};
  if (bytes[2] == kMtData2 && !items_can_fill(bytes, *payload)) return {};
  if (bytes.size() < length) return {FrameKind::kIncomplete};
  if (byte_sum(bytes.subspan(1, length - 1)) != 0) return {FrameKind::kBadChecksum};
  if (begins_twice(bytes.first(length))) return {};
  return {FrameKind::kComplete, length};
}

XsensMessage Xsens::read_message(Bytes frame) {
  if (frame[2] != kMtData2) return {};
  const XsensItems items = items_of(frame);
  bool is_partial = false;
  for (std::size_t i = 0; i < items.accel.size(); ++i) {
    is_partial = is_partial || items.accel.at(i) || items.gyro.at(i);
    if (!items.accel.at(i) || !items.gyro.at(i)) continue;
    return {.quantity = static_cast<XsensQuantity>(i),
            .reading = {.verdict = items.clipped ? ImuVerdict::kSaturated : ImuVerdict::kSample,
                        .gyro_radps = *items.gyro.at(i),
                        .accel_mps2 = *items.accel.at(i),
                        .time = items.time},
            .counter = items.counter};
  }
  return {.reading = {.verdict = is_partial ? ImuVerdict::kPartial : ImuVerdict::kOther}};
}

std::optional<double> IncrementPeriod::update(DeviceTime time, std::uint16_t counter) {
  constexpr double kLongestStep = 0.5;  // s
  constexpr double kEnough = 1.0;       // s: the clock's steps are then 1e-4 of it
  const Mark mark{time.ns, counter};
  if (!last_) {
    restart(mark);
    return std::nullopt;
  }
  const std::uint64_t wrap = time.wrap_ns;
  const double step_s = 1e-9 * static_cast<double>((mark.ticks_ns + wrap - last_->ticks_ns) % wrap);
  const auto steps = static_cast<std::uint16_t>(mark.counter - last_->counter);
  if (steps == 0 || step_s <= 0.0 || step_s > kLongestStep) {
    restart(mark);
    return std::nullopt;
  }
  last_ = mark;
  elapsed_s_ += step_s;
  messages_ += steps;
  stride_ = stride_ == 0 ? steps : std::min<std::uint64_t>(stride_, steps);
  if (elapsed_s_ < kEnough) return std::nullopt;
  return elapsed_s_ / static_cast<double>(messages_) * static_cast<double>(stride_);
}

void IncrementPeriod::restart(const Mark& mark) {
  *this = IncrementPeriod();
  last_ = mark;
}

void XsensParser::parse(Bytes frame, Timestamp arrival,
                        const std::function<void(const ImuSample&)>& sink) {
  sends_old_format_ = frame[2] == kMtData;
  XsensMessage message = Xsens::read_message(frame);
  if (!is_chosen(frame[1], message.quantity, arrival)) return;
  if (message.quantity == XsensQuantity::kIncrement) divide_by_period(message);
  forward_sample(message.reading, arrival, clock_, counts_, sink);
}

void XsensParser::divide_by_period(XsensMessage& message) {
  ImuReading& reading = message.reading;
  lacks_period_ = !reading.time || !message.counter;
  const auto period =
      lacks_period_ ? std::nullopt : period_.update(*reading.time, *message.counter);
  if (!period) {
    reading.verdict = ImuVerdict::kPartial;
    return;
  }
  reading.gyro_radps /= *period;
  reading.accel_mps2 /= *period;
}

bool XsensParser::is_chosen(std::uint8_t bus, XsensQuantity quantity, Timestamp arrival) {
  constexpr Duration kSilence = std::chrono::seconds(1);
  if (quantity == XsensQuantity::kNone) return !source_ || source_->bus == bus;
  const bool is_silent = !source_ || arrival - source_->heard > kSilence;
  const bool is_of_it = source_ && source_->bus == bus;
  if (!is_silent && (!is_of_it || quantity > source_->quantity)) return false;
  if (!is_of_it || quantity != source_->quantity) {
    clock_.change_clock();
    period_ = {};
  }
  source_ = Source{bus, quantity, arrival};
  return true;
}

std::string XsensParser::no_measurement_reason() const {
  if (sends_old_format_) return std::string(Xsens::kOldFormat);
  return std::string(lacks_period_ ? Xsens::kNoPeriod : Xsens::kNoSamples);
}

}  // namespace crepes
