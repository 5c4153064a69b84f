#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "net/mesh/byte_reader.hpp"
#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_layout.hpp"

namespace crepes {
namespace wire {
namespace {

constexpr Duration kMaxAhead = std::chrono::milliseconds{100};  // of stamps, whose clock is one
constexpr Duration kMaxReportAge = std::chrono::seconds{2};     // when it leaves

/// Reads field by field and stores the first error; fields after it are not used.
class Decoder {
 public:
  explicit Decoder(std::span<const std::uint8_t> body) : in_(body) {}

  [[nodiscard]] std::optional<PeerMessageError> fault() const {
    if (!in_.ok()) return PeerMessageError::kTruncated;
    if (fault_) return fault_;
    if (!in_.at_end()) return PeerMessageError::kTrailingBytes;
    return std::nullopt;
  }

  PeerMessage read() {
    PeerMessage message;
    message.report.sender = robot();
    message.session = in_.read<std::uint32_t>();
    message.sequence = in_.read<std::uint32_t>();
    message.sent = PeerTimestamp{Duration{bounded_stamp(in_.read<std::int64_t>())}};
    base_tick_ = floor_to_ticks(to_ns(message.sent));
    message.report.stamp = time(in_.read<std::int32_t>());
    expect(message.report.stamp <= message.sent + kMaxAhead &&
               message.report.stamp >= message.sent - kMaxReportAge,
           PeerMessageError::kBadStamp);
    message.report.tilt = tilt();
    expect(message.report.tilt.stamp <= message.report.stamp + kMaxAhead,
           PeerMessageError::kBadStamp);
    each(kEchoSize, [&] { message.echoes.push_back(echo(message.sent)); });
    imu(message.report.imu);
    bearings(message.report.bearings);
    each(kRangeSize, [&] { message.report.ranges.push_back(range()); });
    each(kEstimateSize, [&] { message.report.estimates.push_back(estimate()); });
    return message;
  }

 private:
  void expect(bool condition, PeerMessageError fault) {
    if (!condition && !fault_ && in_.ok()) fault_ = fault;
  }

  /// The next byte is a count: calls `read_one` that often, if that many items can follow.
  template <class ReadOne>
  void each(std::size_t item_size, ReadOne read_one) {
    repeat(in_.read<std::uint8_t>(), item_size, read_one);
  }
  template <class ReadOne>
  void repeat(std::size_t n, std::size_t item_size, ReadOne read_one) {
    expect(n * item_size <= in_.remaining(), PeerMessageError::kTruncated);
    for (std::size_t i = 0; i < n && !fault_; ++i) read_one();
  }

  [[nodiscard]] PeerTimestamp time(std::int64_t ticks) const {
    return PeerTimestamp{Duration{(base_tick_ + ticks) * kTick}};
  }
  PeerTimestamp stamp() { return time(in_.read<std::int16_t>()); }

  std::int64_t bounded_stamp(std::int64_t ns) {
    const bool bounded = ns >= -kMaxStamp && ns <= kMaxStamp;
    expect(bounded, PeerMessageError::kBadStamp);
    return bounded ? ns : 0;
  }

  RobotId robot() {
    const RobotId id{in_.read<std::uint16_t>()};
    expect(is_robot(id), PeerMessageError::kBadId);
    return id;
  }

  double number(double limit) {
    const double value = in_.read_float();
    expect(std::isfinite(value), PeerMessageError::kNotFinite);
    expect(std::abs(value) <= limit, PeerMessageError::kOutOfRange);
    return value;
  }

  Eigen::Vector3d vector() {
    Eigen::Vector3d v;
    for (double& x : v) x = number(kMaxCoordinate);
    return v;
  }

  Eigen::Vector3d direction() {
    const auto a = in_.read<std::int16_t>();
    const auto b = in_.read<std::int16_t>();
    const auto u = decode_direction({a, b});
    expect(u.has_value(), PeerMessageError::kNotUnit);
    return u.value_or(Eigen::Vector3d::UnitZ());
  }

  BasicTilt<PeerTimestamp> tilt() {
    BasicTilt<PeerTimestamp> tilt;
    tilt.stamp = time(in_.read<std::int32_t>());
    tilt.up_B = direction();
    tilt.sigma_rad = number(kUnknownTiltSigma + 1e-6);
    expect(tilt.sigma_rad > 0, PeerMessageError::kOutOfRange);
    return tilt;
  }

  ClockEcho echo(PeerTimestamp sent) {
    ClockEcho echo;
    echo.peer = robot();
    echo.sent_ns = bounded_stamp(in_.read<std::int64_t>());
    echo.received_ns = to_ns(sent) - std::int64_t{in_.read<std::uint32_t>()} * 1000;
    return echo;
  }

  int exponent() {
    const auto exponent = in_.read<std::int8_t>();
    expect(exponent >= kMinExponent && exponent <= kMaxExponent, PeerMessageError::kOutOfRange);
    return exponent;
  }

  void imu(std::vector<BasicImuSample<PeerTimestamp>>& samples) {
    const std::size_t n = in_.read<std::uint8_t>();
    const int gyro = exponent();
    const int accel = exponent();
    repeat(n, kImuSize, [&] {
      auto& sample = samples.emplace_back();
      sample.stamp = stamp();
      for (double& v : sample.gyro_radps) v = std::ldexp(in_.read<std::int16_t>(), gyro);
      for (double& v : sample.accel_mps2) v = std::ldexp(in_.read<std::int16_t>(), accel);
    });
  }

  void bearings(std::vector<BasicBearing<PeerTimestamp>>& bearings) {
    std::vector<Eigen::Vector3d> cameras;
    each(kCameraSize, [&] { cameras.push_back(vector()); });
    std::vector<Source> sources;
    each(kSourceSize, [&] {
      const RobotId neighbor = robot();
      sources.push_back({neighbor, in_.read<std::uint8_t>()});
      expect(sources.back().camera < cameras.size(), PeerMessageError::kBadIndex);
    });
    each(kBearingSize, [&] {
      auto& bearing = bearings.emplace_back();
      bearing.stamp = stamp();
      const std::size_t source = in_.read<std::uint8_t>();
      bearing.u_B = direction();
      bearing.sigma_rad = kBearingSigma.decode(in_.read<std::uint8_t>());
      expect(source < sources.size(), PeerMessageError::kBadIndex);
      if (fault_ || source >= sources.size()) return;
      bearing.neighbor = sources[source].neighbor;
      bearing.p_B_C = cameras[sources[source].camera];
    });
  }

  BasicUwbRange<PeerTimestamp> range() {
    BasicUwbRange<PeerTimestamp> range;
    range.neighbor = robot();
    range.stamp = stamp();
    range.range_m = number(kMaxRange);
    expect(range.range_m > 0, PeerMessageError::kOutOfRange);
    range.first_path_dbm = -0.5 * in_.read<std::uint8_t>();
    range.received_dbm = -0.5 * in_.read<std::uint8_t>();
    return range;
  }

  BasicNeighborEstimate<PeerTimestamp> estimate() {
    BasicNeighborEstimate<PeerTimestamp> estimate;
    estimate.neighbor = robot();
    estimate.stamp = stamp();
    estimate.T_B_N.pose.p = vector();
    Eigen::Vector4d q;
    for (double& v : q) v = in_.read<std::int16_t>() / kMaxCode;
    expect(std::abs(q.norm() - 1) < 1e-3, PeerMessageError::kNotUnit);
    estimate.T_B_N.pose.q = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    estimate.v_B_N = vector();
    CovarianceCode code;
    for (std::uint16_t& sigma : code.sigmas) sigma = in_.read<std::uint16_t>();
    for (std::int16_t& entry : code.factor) entry = in_.read<std::int16_t>();
    const auto covariance = decode_covariance(code);
    expect(covariance.has_value(), PeerMessageError::kBadCovariance);
    estimate.T_B_N.covariance = covariance.value_or(Matrix6d::Identity());
    return estimate;
  }

  ByteReader in_;
  std::int64_t base_tick_ = 0;
  std::optional<PeerMessageError> fault_;
};

std::uint32_t checksum_of(std::span<const std::uint8_t> datagram) {
  ByteReader in(datagram.last(kChecksum));
  return in.read<std::uint32_t>();
}

}  // namespace
}  // namespace wire

tl::expected<PeerMessage, PeerMessageError> decode_peer_message(
    std::span<const std::uint8_t> datagram) {
  using Fault = PeerMessageError;
  constexpr std::size_t kPreamble = wire::kMagic.size() + 1;
  if (datagram.size() > kMaxPeerMessage) return tl::unexpected(Fault::kTooLong);
  if (datagram.size() < kPreamble + wire::kChecksum) return tl::unexpected(Fault::kTooShort);
  if (!std::equal(wire::kMagic.begin(), wire::kMagic.end(), datagram.begin()))
    return tl::unexpected(Fault::kForeign);
  if (datagram[wire::kMagic.size()] != wire::kVersion) return tl::unexpected(Fault::kOtherVersion);
  if (crc32(datagram.first(datagram.size() - wire::kChecksum)) != wire::checksum_of(datagram))
    return tl::unexpected(Fault::kDamaged);

  wire::Decoder decoder(datagram.subspan(kPreamble, datagram.size() - kPreamble - wire::kChecksum));
  PeerMessage message = decoder.read();
  if (const auto fault = decoder.fault()) return tl::unexpected(*fault);
  return message;
}

}  // namespace crepes
