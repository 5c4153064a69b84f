#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_code.hpp"

namespace crepes {
namespace wire {
namespace {

/// Integers to values. The stream has checked their bounds.
class Dequantizer {
 public:
  explicit Dequantizer(const CodedBody& body)
      : body_(body), base_tick_(floor_to_ticks(static_cast<std::int64_t>(body.sent_ns))) {}

  /// Empty for a covariance that is not positive definite or a quaternion that is none.
  [[nodiscard]] tl::expected<PeerMessage, PeerMessageError> message() const {
    PeerMessage message;
    message.mark = body_.mark;
    PeerReport& report = message.report;
    message.sent = PeerTimestamp{Duration{static_cast<std::int64_t>(body_.sent_ns)}};
    report.stamp = time(body_.report_age);
    report.tilt = tilt();
    for (const CodedEcho& code : body_.echoes) message.echoes.push_back(echo(code));
    for (const CodedImuSample& code : body_.imu.samples) report.imu.push_back(sample(code));
    std::ranges::reverse(report.imu);  // oldest first
    for (const CodedSource& source : body_.sources) {
      const RobotId neighbor{static_cast<std::uint16_t>(source.neighbor)};
      for (const CodedBearing& code : source.bearings)
        report.bearings.push_back(bearing(neighbor, code));
      for (const CodedRange& code : source.ranges) report.ranges.push_back(range(neighbor, code));
    }
    for (const CodedEstimate& code : body_.estimates) {
      auto decoded = estimate(code);
      if (!decoded) return tl::unexpected(decoded.error());
      report.estimates.push_back(*decoded);
    }
    return message;
  }

 private:
  [[nodiscard]] PeerTimestamp time(std::int64_t age) const {
    return PeerTimestamp{Duration{(base_tick_ - age) * kTick}};
  }

  static Eigen::Vector3d vector(const std::array<std::int64_t, 3>& code, double step) {
    return step * Eigen::Vector3d(static_cast<double>(code[0]), static_cast<double>(code[1]),
                                  static_cast<double>(code[2]));
  }

  [[nodiscard]] BasicTilt<PeerTimestamp> tilt() const {
    if (!body_.tilt) return {time(0), Eigen::Vector3d::UnitZ(), kUnknownTiltSigma};
    return {time(body_.tilt->age), decode_direction(body_.tilt->up),
            kTiltSigma.decode(body_.tilt->sigma)};
  }

  [[nodiscard]] ClockEcho echo(const CodedEcho& code) const {
    return {.peer = RobotId{code.peer},
            .sent_code = code.sent_code,
            .received_ns = static_cast<std::int64_t>(body_.sent_ns) -
                           static_cast<std::int64_t>(code.age_us) * 1000,
            .loss = code.loss / kLossSteps,
            .is_direct = code.is_direct};
  }

  [[nodiscard]] BasicImuSample<PeerTimestamp> sample(const CodedImuSample& code) const {
    BasicImuSample<PeerTimestamp> sample{.stamp = time(code.age)};
    for (int i = 0; i < 3; ++i) {
      const auto axis = static_cast<std::size_t>(i);
      sample.gyro_radps[i] =
          std::ldexp(static_cast<double>(code.values.at(axis)), body_.imu.gyro_exponent);
      sample.accel_mps2[i] =
          std::ldexp(static_cast<double>(code.values.at(axis + 3)), body_.imu.accel_exponent);
    }
    return sample;
  }

  [[nodiscard]] BasicBearing<PeerTimestamp> bearing(RobotId neighbor,
                                                    const CodedBearing& code) const {
    return {.stamp = time(code.age),
            .neighbor = neighbor,
            .u_B = decode_direction(code.u),
            .p_B_C = vector(body_.cameras[code.camera], kCameraStep),
            .sigma_rad = kBearingSigma.decode(static_cast<unsigned>(code.sigma))};
  }

  [[nodiscard]] BasicUwbRange<PeerTimestamp> range(RobotId neighbor, const CodedRange& code) const {
    return {.stamp = time(code.age),
            .neighbor = neighbor,
            .range_m = 1e-3 * static_cast<double>(code.range_mm),
            .first_path_dbm = -0.5 * static_cast<double>(code.first_path),
            .received_dbm = -0.5 * static_cast<double>(code.received)};
  }

  [[nodiscard]] tl::expected<BasicNeighborEstimate<PeerTimestamp>, PeerMessageError> estimate(
      const CodedEstimate& code) const {
    Eigen::Vector4d q = Eigen::Vector4d::Zero();  // x y z w
    std::size_t next = 0;
    for (unsigned i = 0; i < 4; ++i) {
      if (i != code.largest)
        q[i] = static_cast<double>(code.q.at(next++)) /
               (std::numbers::sqrt2 * static_cast<double>(kQuaternionUnit));
    }
    const double rest = 1 - q.squaredNorm();
    if (rest < 0.2) return tl::unexpected(PeerMessageError::kNotUnit);  // the largest: at least 1/4
    q[code.largest] = std::sqrt(rest);
    const auto covariance = decode_covariance({code.sigmas, code.factor});
    if (!covariance) return tl::unexpected(PeerMessageError::kBadCovariance);
    BasicNeighborEstimate<PeerTimestamp> estimate;
    estimate.neighbor = RobotId{static_cast<std::uint16_t>(code.neighbor)};
    estimate.stamp = time(code.age);
    estimate.T_B_N.pose.p = vector(code.p, kPlaceStep);
    estimate.T_B_N.pose.q = Eigen::Quaterniond(q).normalized();
    estimate.T_B_N.covariance = *covariance;
    estimate.v_B_N = vector(code.v, kSpeedStep);
    return estimate;
  }

  const CodedBody& body_;
  std::int64_t base_tick_;
};

tl::expected<PeerMessage, PeerMessageError> read(std::span<const std::uint8_t> datagram,
                                                 const PeerHeader& header) {
  if (!is_robot(header.sender)) return tl::unexpected(PeerMessageError::kBadId);

  BodyReader stream(datagram.subspan(kClearHeader, datagram.size() - kClearHeader - kChecksum));
  CodedBody body;
  code_body(stream, body);
  if (const auto fault = stream.fault()) return tl::unexpected(*fault);
  if (!stream.at_end()) return tl::unexpected(PeerMessageError::kTrailingBytes);
  return Dequantizer(body).message().map([&](PeerMessage message) {
    message.report.sender = header.sender;
    message.session = header.session;
    message.sequence = header.sequence;
    return message;
  });
}

}  // namespace
}  // namespace wire

tl::expected<PeerHeader, PeerMessageError> decode_peer_header(
    std::span<const std::uint8_t> datagram) {
  using Fault = PeerMessageError;
  constexpr std::size_t kVersionAt = wire::kMagic.size();
  if (datagram.size() > kMaxPeerMessage) return tl::unexpected(Fault::kTooLong);
  if (datagram.size() < kVersionAt + 1 + wire::kChecksum) return tl::unexpected(Fault::kTooShort);
  if (!std::equal(wire::kMagic.begin(), wire::kMagic.end(), datagram.begin()))
    return tl::unexpected(Fault::kForeign);
  if ((datagram[kVersionAt] & ~kSignedMark) != wire::kVersion)
    return tl::unexpected(Fault::kOtherVersion);
  if (datagram.size() < kClearHeader + wire::kChecksum) return tl::unexpected(Fault::kTooShort);
  BitReader fields(datagram.subspan(kVersionAt + 1));
  PeerHeader header;
  header.sender = RobotId{static_cast<std::uint16_t>(fields.bits(16))};
  header.session = fields.bits(64);
  header.sequence = static_cast<std::uint32_t>(fields.bits(32));
  return header;
}

tl::expected<PeerMessage, PeerMessageError> decode_peer_message(
    std::span<const std::uint8_t> datagram) {
  const auto header = decode_peer_header(datagram);
  if (!header) return tl::unexpected(header.error());
  if (datagram[wire::kMagic.size()] != wire::kVersion)
    return tl::unexpected(PeerMessageError::kOtherVersion);
  if (crc32(datagram.first(datagram.size() - wire::kChecksum)) !=
      BitReader(datagram.last(wire::kChecksum)).bits(32))
    return tl::unexpected(PeerMessageError::kDamaged);
  return wire::read(datagram, *header);
}

}  // namespace crepes
