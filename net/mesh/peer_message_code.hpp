/// The body of a datagram as integers, and its layout in bits, defined once for both directions.
///
/// Numbers of a list follow from those before: ages by their second difference, directions by
/// linear extrapolation, all with exponential Golomb codes. Lists are the newest first.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <vector>

#include "net/mesh/bit_reader.hpp"
#include "net/mesh/bit_writer.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_layout.hpp"

namespace crepes::wire {

/// Ages are in ticks before the datagram's own; those of the future are negative.
struct CodedTilt {
  std::int64_t age = 0;
  std::array<std::int64_t, 2> up{};
  unsigned sigma = 0;
};

/// A `ClockEcho` in integers.
struct CodedEcho {
  std::uint16_t peer = 0;
  std::uint32_t sent_code = 0;
  std::uint64_t age_us = 0;
  unsigned loss = 0;
  bool is_direct = false;
};

/// How the values of three axes are predicted, and the order of their code.
struct Prediction {
  bool is_linear = false;  ///< from the two samples before; else from one
  unsigned order = 0;
};

/// An inertial sample in steps of the rounding.
struct CodedImuSample {
  std::int64_t age = 0;
  std::array<std::int64_t, 6> values{};  ///< gyro, acceleration
};

/// All inertial samples of a datagram, in integers.
struct CodedImu {
  int gyro_exponent = 0;
  int accel_exponent = 0;
  std::array<Prediction, 2> predictions{};
  std::vector<CodedImuSample> samples;
};

/// A bearing in integers.
struct CodedBearing {
  std::int64_t age = 0;
  std::uint64_t camera = 0;
  std::array<std::int64_t, 2> u{};
  std::int64_t sigma = 0;
};

/// A range in integers.
struct CodedRange {
  std::int64_t age = 0;
  std::int64_t range_mm = 0;
  std::int64_t received = 0;    ///< -0.5 dBm
  std::int64_t first_path = 0;  ///< -0.5 dBm
};

/// What is known of one neighbor.
struct CodedSource {
  std::uint64_t neighbor = 0;
  std::vector<CodedBearing> bearings;
  std::vector<CodedRange> ranges;
};

/// An estimate of a neighbor, in integers.
struct CodedEstimate {
  std::uint64_t neighbor = 0;
  std::int64_t age = 0;
  std::array<std::int64_t, 3> p{};
  unsigned largest = 0;             ///< component of the quaternion that is left out
  std::array<std::int64_t, 3> q{};  ///< the others
  std::array<std::int64_t, 3> v{};
  std::array<unsigned, 6> sigmas{};
  std::array<std::int64_t, 15> factor{};
};

/// Everything after the clear header, in integers.
struct CodedBody {
  std::uint64_t sent_ns = 0;  ///< two's complement
  unsigned mark = 0;
  std::int64_t report_age = 0;
  std::optional<CodedTilt> tilt;
  std::vector<CodedEcho> echoes;
  CodedImu imu;
  std::vector<std::array<std::int64_t, 3>> cameras;
  std::vector<CodedSource> sources;  ///< ordered by neighbor
  std::vector<CodedEstimate> estimates;
};

/// What a field may hold.
struct Bounds {
  std::int64_t min;
  std::int64_t max;
};
/// From `-limit` to `limit`.
[[nodiscard]] constexpr Bounds up_to(std::int64_t limit) { return {-limit, limit}; }

/// Writes the fields that it visits.
class BodyWriter {
 public:
  /// A number of `count` bits.
  template <class Value>
  void bits(const Value& value, unsigned count) {
    out_.wide_bits(static_cast<std::uint64_t>(value), count);
  }
  /// A number of variable length, shortest below 2^k.
  template <class Value>
  void number(const Value& value, unsigned k) {
    out_.number(static_cast<std::uint64_t>(value), k);
  }
  /// `value`, of which the reader knows `predicted`.
  void delta(std::int64_t value, std::int64_t predicted, unsigned k, Bounds /*bounds*/,
             PeerMessageError /*outside*/) {
    out_.signed_number(value - predicted, k);
  }
  /// The length of a list.
  template <class Item>
  void size(const std::vector<Item>& items, unsigned k) {
    out_.number(items.size(), k);
  }
  /// Whether there is a value.
  template <class Item>
  void presence(const std::optional<Item>& item) {
    out_.bits(item ? 1 : 0, 1);
  }
  /// The writer writes nothing that the reader refuses.
  void expect(bool /*holds*/, PeerMessageError /*fault*/) {}
  [[nodiscard]] std::vector<std::uint8_t> finished() && { return std::move(out_).finished(); }

 private:
  BitWriter out_;
};

/// Reads the fields that it visits. After the first fault all numbers are 0 and all lists empty.
class BodyReader {
 public:
  static constexpr std::size_t kMaxItems = 64;  ///< of a list

  explicit BodyReader(std::span<const std::uint8_t> bytes) : in_(bytes) {}

  /// A number of `count` bits.
  template <class Value>
  void bits(Value& value, unsigned count) {
    constexpr unsigned kHalf = 32;
    std::uint64_t code = in_.bits(std::min(count, kHalf));
    if (count > kHalf) code |= in_.bits(count - kHalf) << kHalf;
    value = fault() ? Value{} : static_cast<Value>(code);
  }
  /// A number of variable length.
  template <class Value>
  void number(Value& value, unsigned k) {
    const std::uint64_t code = in_.number(k);
    value = fault() ? Value{} : static_cast<Value>(code);
  }
  /// Outside of `bounds`, the value is 0 and the fault is `outside`.
  void delta(std::int64_t& value, std::int64_t predicted, unsigned k, Bounds bounds,
             PeerMessageError outside) {
    value = predicted + in_.signed_number(k);
    expect(value >= bounds.min && value <= bounds.max, outside);
    if (fault()) value = 0;
  }
  /// The length of a list, at most kMaxItems and what the remaining bits can hold.
  template <class Item>
  void size(std::vector<Item>& items, unsigned k) {
    const std::uint64_t count = in_.number(k);
    expect(count <= kMaxItems && count <= in_.remaining(), PeerMessageError::kTruncated);
    items.resize(fault() ? 0 : static_cast<std::size_t>(count));
  }
  /// Whether there is a value.
  template <class Item>
  void presence(std::optional<Item>& item) {
    if (in_.bits(1) != 0) item.emplace();
  }
  /// Keeps the first fault.
  void expect(bool holds, PeerMessageError fault) {
    if (!holds && in_.ok() && !fault_) fault_ = fault;
  }
  [[nodiscard]] std::optional<PeerMessageError> fault() const {
    if (fault_) return fault_;
    return in_.ok() ? std::nullopt : std::optional(PeerMessageError::kTruncated);
  }
  [[nodiscard]] bool at_end() const { return in_.at_end(); }

 private:
  BitReader in_;
  std::optional<PeerMessageError> fault_;
};

/// Of measurements and estimates. What a robot sends has happened, but for errors of its stamps.
inline constexpr Bounds kAges{-kMaxAhead, kMaxAge};

/// The age of the item `i` from those before it.
template <class Stream, class Item>
void code_age(Stream& stream, std::vector<Item>& items, std::size_t i, unsigned k) {
  constexpr unsigned kFirst = 9;
  std::int64_t& age = items[i].age;
  const std::int64_t predicted = i == 0   ? 0
                                 : i == 1 ? items[0].age
                                          : 2 * items[i - 1].age - items[i - 2].age;
  stream.delta(age, predicted, i < 2 ? kFirst : k, kAges, PeerMessageError::kBadStamp);
}

/// A direction.
template <class Stream>
void code_direction(Stream& stream, std::array<std::int64_t, 2>& direction) {
  for (std::int64_t& component : direction) {
    std::int64_t offset = component + kDirectionUnit;
    stream.bits(offset, kDirectionBits);
    component = offset - kDirectionUnit;
    stream.expect(std::abs(component) <= kDirectionUnit, PeerMessageError::kNotUnit);
  }
}

/// An echo.
template <class Stream>
void code_echo(Stream& stream, CodedEcho& echo) {
  constexpr unsigned kAge = 14;
  stream.bits(echo.peer, 16);
  stream.expect(echo.peer >= 1 && echo.peer <= kMaxId, PeerMessageError::kBadId);
  stream.bits(echo.sent_code, 32);
  stream.number(echo.age_us, kAge);
  stream.expect(echo.age_us <= kMaxEchoAgeUs, PeerMessageError::kBadStamp);
  stream.bits(echo.loss, kLossBits);
  stream.bits(echo.is_direct, 1);
}

/// Prediction of the value of `axis` in sample `i` from the newer ones.
[[nodiscard]] inline std::int64_t predicted_value(const std::vector<CodedImuSample>& samples,
                                                  std::size_t i, std::size_t axis, bool is_linear) {
  if (i == 0) return 0;
  const std::int64_t last = samples[i - 1].values.at(axis);
  return is_linear && i > 1 ? 2 * last - samples[i - 2].values.at(axis) : last;
}

/// All inertial samples.
template <class Stream>
void code_imu(Stream& stream, CodedImu& imu) {
  constexpr unsigned kExponentBits = 6;
  constexpr unsigned kOrderBits = 4;
  constexpr unsigned kFirstValue = 9;
  constexpr unsigned kJitter = 3;
  stream.size(imu.samples, 3);
  if (imu.samples.empty()) return;
  for (int* exponent : {&imu.gyro_exponent, &imu.accel_exponent}) {
    int offset = *exponent - kMinExponent;
    stream.bits(offset, kExponentBits);
    *exponent = offset + kMinExponent;
    stream.expect(*exponent <= kMaxExponent, PeerMessageError::kOutOfRange);
  }
  for (Prediction& prediction : imu.predictions) {
    stream.bits(prediction.is_linear, 1);
    stream.bits(prediction.order, kOrderBits);
  }
  for (std::size_t i = 0; i < imu.samples.size(); ++i) {
    code_age(stream, imu.samples, i, kJitter);
    for (std::size_t axis = 0; axis < 6; ++axis) {
      const Prediction& prediction = imu.predictions.at(axis / 3);
      std::int64_t& value = imu.samples[i].values.at(axis);
      stream.delta(value, predicted_value(imu.samples, i, axis, prediction.is_linear),
                   i == 0 ? kFirstValue : prediction.order, up_to(kMaxImuCode),
                   PeerMessageError::kOutOfRange);
    }
  }
}

/// A component of the direction of bearing `i`, extrapolated from the two before it.
[[nodiscard]] inline std::int64_t extrapolated(const std::vector<CodedBearing>& bearings,
                                               std::size_t i, std::size_t component) {
  constexpr std::int64_t kMaxRatio = 4;
  const std::int64_t last = bearings[i - 1].u.at(component);
  if (i < 2) return last;
  const std::int64_t before = bearings[i - 1].age - bearings[i - 2].age;
  const std::int64_t dt = bearings[i].age - bearings[i - 1].age;
  if (before <= 0 || std::abs(dt) > kMaxRatio * before) return last;
  return last + (last - bearings[i - 2].u.at(component)) * dt / before;
}

/// The bearings of one neighbor.
template <class Stream>
void code_bearings(Stream& stream, std::vector<CodedBearing>& bearings, std::size_t cameras) {
  constexpr unsigned kStep = 6;
  constexpr unsigned kJitter = 4;
  stream.size(bearings, 2);
  for (std::size_t i = 0; i < bearings.size(); ++i) {
    CodedBearing& bearing = bearings[i];
    code_age(stream, bearings, i, kJitter);
    if (cameras > 1) stream.number(bearing.camera, 0);
    stream.expect(bearing.camera < cameras, PeerMessageError::kBadIndex);
    if (i == 0) {
      code_direction(stream, bearing.u);
      stream.bits(bearing.sigma, kBearingSigmaBits);
      continue;
    }
    for (std::size_t c = 0; c < 2; ++c) {
      stream.delta(bearing.u.at(c), extrapolated(bearings, i, c), kStep, up_to(kDirectionUnit),
                   PeerMessageError::kNotUnit);
    }
    stream.delta(bearing.sigma, bearings[i - 1].sigma, 0, {0, kBearingSigma.steps},
                 PeerMessageError::kOutOfRange);
  }
}

/// The ranges to one neighbor.
template <class Stream>
void code_ranges(Stream& stream, std::vector<CodedRange>& ranges) {
  constexpr unsigned kFirstRange = 12;
  constexpr unsigned kStep = 5;
  constexpr unsigned kJitter = 6;
  constexpr unsigned kFirstPower = 5;
  constexpr std::int64_t kTypicalPower = 160;  // -80 dBm
  stream.size(ranges, 1);
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    CodedRange& range = ranges[i];
    code_age(stream, ranges, i, kJitter);
    const CodedRange newer = i == 0 ? CodedRange{.received = kTypicalPower} : ranges[i - 1];
    stream.delta(range.range_mm, newer.range_mm, i == 0 ? kFirstRange : kStep, {1, kMaxRangeMm},
                 PeerMessageError::kOutOfRange);
    stream.delta(range.received, newer.received, i == 0 ? kFirstPower : 1, {0, kMaxPower},
                 PeerMessageError::kOutOfRange);
    stream.delta(range.first_path, range.received, 2, {0, kMaxPower},
                 PeerMessageError::kOutOfRange);
  }
}

/// Bearings and ranges by neighbor.
template <class Stream>
void code_sources(Stream& stream, CodedBody& body) {
  constexpr unsigned kPlace = 11;
  constexpr unsigned kNextId = 2;
  stream.size(body.cameras, 0);
  for (std::array<std::int64_t, 3>& camera : body.cameras) {
    for (std::int64_t& coordinate : camera)
      stream.delta(coordinate, 0, kPlace, up_to(kMaxCoordinateCode), PeerMessageError::kOutOfRange);
  }
  stream.size(body.sources, 3);
  std::uint64_t last = 0;
  for (CodedSource& source : body.sources) {
    std::uint64_t step = source.neighbor - last - 1;
    stream.number(step, kNextId);
    source.neighbor = last += step + 1;
    stream.expect(source.neighbor <= kMaxId, PeerMessageError::kBadId);
    code_bearings(stream, source.bearings, body.cameras.size());
    code_ranges(stream, source.ranges);
  }
}

/// An estimate of a neighbor.
template <class Stream>
void code_estimate(Stream& stream, CodedEstimate& estimate) {
  constexpr unsigned kIdBits = 16;
  constexpr unsigned kPlace = 14;
  constexpr unsigned kSpeed = 9;
  constexpr unsigned kStamp = 9;
  stream.bits(estimate.neighbor, kIdBits);
  stream.expect(estimate.neighbor >= 1 && estimate.neighbor <= kMaxId, PeerMessageError::kBadId);
  stream.delta(estimate.age, 0, kStamp, kAges, PeerMessageError::kBadStamp);
  for (std::int64_t& x : estimate.p)
    stream.delta(x, 0, kPlace, up_to(kMaxCoordinateCode), PeerMessageError::kOutOfRange);
  stream.bits(estimate.largest, 2);
  for (std::int64_t& x : estimate.q) {
    std::int64_t offset = x + kQuaternionUnit;
    stream.bits(offset, kQuaternionBits);
    x = offset - kQuaternionUnit;
    stream.expect(x <= kQuaternionUnit, PeerMessageError::kNotUnit);
  }
  for (std::int64_t& x : estimate.v)
    stream.delta(x, 0, kSpeed, up_to(kMaxCoordinateCode), PeerMessageError::kOutOfRange);
  for (unsigned& sigma : estimate.sigmas) stream.bits(sigma, kSigmaBits);
  for (std::int64_t& entry : estimate.factor) {
    std::int64_t offset = entry + kFactorUnit;
    stream.bits(offset, kFactorBits);
    entry = offset - kFactorUnit;
    stream.expect(entry <= kFactorUnit, PeerMessageError::kBadCovariance);
  }
}

/// The whole body, in this order.
template <class Stream>
void code_body(Stream& stream, CodedBody& body) {
  constexpr unsigned kStamp = 8;
  stream.bits(body.sent_ns, 64);
  const auto sent_ns = static_cast<std::int64_t>(body.sent_ns);
  stream.expect(sent_ns >= -kMaxStamp && sent_ns <= kMaxStamp, PeerMessageError::kBadStamp);
  stream.bits(body.mark, kMarkBits);
  stream.delta(body.report_age, 0, kStamp, {-kMaxAhead, kMaxReportAge},
               PeerMessageError::kBadStamp);
  stream.presence(body.tilt);
  if (body.tilt) {
    stream.delta(body.tilt->age, body.report_age, kStamp,
                 {body.report_age - kMaxAhead, kMaxTiltAge}, PeerMessageError::kBadStamp);
    code_direction(stream, body.tilt->up);
    stream.bits(body.tilt->sigma, kTiltSigmaBits);
  }
  stream.size(body.echoes, 1);
  for (CodedEcho& echo : body.echoes) code_echo(stream, echo);
  code_imu(stream, body.imu);
  code_sources(stream, body);
  stream.size(body.estimates, 0);
  for (CodedEstimate& estimate : body.estimates) code_estimate(stream, estimate);
}

}  // namespace crepes::wire
