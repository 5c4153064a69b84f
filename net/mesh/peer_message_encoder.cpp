#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "estimator/core/contract.hpp"
#include "net/mesh/byte_writer.hpp"
#include "net/mesh/crc32.hpp"
#include "net/mesh/peer_message.hpp"
#include "net/mesh/peer_message_layout.hpp"

namespace crepes {
namespace wire {
namespace {

constexpr std::size_t kHeader = 26;
constexpr std::size_t kMaxEchoes = 10;
constexpr std::size_t kMaxImu =
    16;  // 160 ms at 100 Hz: tolerates the loss of one datagram in three
constexpr std::size_t kEstimateBudget = 450;
constexpr std::size_t kMaxCount = 255;
constexpr std::size_t kTilt = 12;
constexpr std::size_t kCounts = 7 + 2;  // of the lists, and the IMU's exponents
constexpr std::size_t kAlways = kHeader + kTilt + kCounts + kChecksum;
constexpr std::size_t kFirst =
    kAlways + kMaxEchoes * kEchoSize + kMaxImu * kImuSize + kEstimateBudget;

std::int64_t round_to_ticks(std::int64_t ns) { return floor_to_ticks(ns + kTick / 2); }

/// Ticks from the datagram's stamp, if they fit the integer of the format.
template <class Integer>
std::optional<Integer> ticks_from(std::int64_t base_tick, Timestamp stamp) {
  const std::int64_t ticks = round_to_ticks(to_ns(stamp)) - base_tick;
  if (!std::in_range<Integer>(ticks)) return std::nullopt;
  return static_cast<Integer>(ticks);
}

bool is_writable(const ImuSample& sample) {
  const double limit = std::ldexp(kMaxCode, kMaxExponent);
  return sample.gyro_radps.cwiseAbs().maxCoeff() < limit &&
         sample.accel_mps2.cwiseAbs().maxCoeff() < limit && sample.gyro_radps.allFinite() &&
         sample.accel_mps2.allFinite();
}

bool is_unit(const Eigen::Vector3d& u) { return std::abs(u.norm() - 1) < 1e-3; }

bool is_writable(const Bearing& bearing) {
  return is_robot(bearing.neighbor) && is_unit(bearing.u_B) && bearing.p_B_C.allFinite() &&
         bearing.p_B_C.cwiseAbs().maxCoeff() < kMaxCoordinate && bearing.sigma_rad > 0 &&
         std::isfinite(bearing.sigma_rad);
}

bool is_writable(const UwbRange& range) {
  return is_robot(range.neighbor) && range.range_m > 0 && range.range_m < kMaxRange &&
         std::isfinite(range.first_path_dbm) && std::isfinite(range.received_dbm);
}

bool is_writable(const NeighborEstimate& estimate) {
  const Pose& pose = estimate.T_B_N.pose;
  return is_robot(estimate.neighbor) && pose.p.allFinite() && estimate.v_B_N.allFinite() &&
         pose.p.cwiseAbs().maxCoeff() < kMaxCoordinate &&
         estimate.v_B_N.cwiseAbs().maxCoeff() < kMaxCoordinate &&
         std::abs(pose.q.norm() - 1) < 1e-3 &&
         encode_covariance(estimate.T_B_N.covariance).has_value();
}

/// A bearing with its index in the table of sources.
struct SourcedBearing {
  const Bearing* bearing;
  std::uint8_t source;
};

/// Index of `item`; appends it if it is new and adds `size` to `cost`. Empty when the table is
/// full.
template <class Item>
std::optional<std::uint8_t> index_in(std::vector<Item>& table, const Item& item, std::size_t size,
                                     std::size_t& cost) {
  const auto found = std::find(table.begin(), table.end(), item);
  const auto index = static_cast<std::size_t>(found - table.begin());
  if (index >= kMaxCount) return std::nullopt;
  if (found == table.end()) {
    table.push_back(item);
    cost += size;
  }
  return static_cast<std::uint8_t>(index);
}

/// The contents of one datagram, selected before encoding.
class Selection {
 public:
  Selection(const OutgoingPeerMessage& message, std::size_t max_bytes)
      : base_tick_(floor_to_ticks(to_ns(message.sent))), room_(max_bytes - kAlways) {
    choose_echoes(message);
    choose_imu(message.report.imu);
    choose_estimates(message.report.estimates, message.sequence);
    choose_bearings_and_ranges(message.report);
  }

  std::vector<ClockEcho> echoes;
  std::vector<const ImuSample*> imu;
  std::vector<Eigen::Vector3d> cameras;
  std::vector<Source> sources;
  std::vector<SourcedBearing> bearings;
  std::vector<const UwbRange*> ranges;
  std::vector<const NeighborEstimate*> estimates;
  std::size_t left_out = 0;
  std::size_t refused = 0;

 private:
  template <class Item>
  std::vector<const Item*> newest_first(const std::vector<Item>& items) {
    std::vector<const Item*> chosen;
    for (const Item& item : items) {
      if (!is_writable(item)) {
        ++refused;
      } else if (!ticks_from<std::int16_t>(base_tick_, item.stamp)) {
        ++left_out;
      } else {
        chosen.push_back(&item);
      }
    }
    std::stable_sort(chosen.begin(), chosen.end(),
                     [](const Item* a, const Item* b) { return a->stamp > b->stamp; });
    return chosen;
  }

  [[nodiscard]] bool reserve_bytes(std::size_t bytes) {
    if (bytes > room_) return false;
    room_ -= bytes;
    return true;
  }

  /// Round-robin if there are more peers than room.
  void choose_echoes(const OutgoingPeerMessage& message) {
    const std::size_t count = std::min(message.echoes.size(), kMaxEchoes);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t turn = std::size_t{message.sequence} * kMaxEchoes + i;
      echoes.push_back(message.echoes[turn % message.echoes.size()]);
      room_ -= kEchoSize;
    }
  }

  void choose_imu(const std::vector<ImuSample>& samples) {
    imu = newest_first(samples);
    if (imu.size() > kMaxImu) {
      left_out += imu.size() - kMaxImu;
      imu.resize(kMaxImu);
    }
    std::reverse(imu.begin(), imu.end());  // oldest first
    room_ -= imu.size() * kImuSize;
  }

  void choose_estimates(const std::vector<NeighborEstimate>& all, std::uint32_t sequence) {
    estimates = newest_first(all);
    constexpr std::size_t kAtOnce = kEstimateBudget / kEstimateSize;
    if (estimates.size() > kAtOnce) {
      left_out += estimates.size() - kAtOnce;
      std::sort(estimates.begin(), estimates.end(),
                [](const auto* a, const auto* b) { return a->neighbor < b->neighbor; });
      std::rotate(estimates.begin(),
                  estimates.begin() + static_cast<std::ptrdiff_t>(std::size_t{sequence} * kAtOnce %
                                                                  estimates.size()),
                  estimates.end());
      estimates.resize(kAtOnce);
    }
    room_ -= estimates.size() * kEstimateSize;
  }

  /// Bearings and ranges together, from the newest to the oldest.
  void choose_bearings_and_ranges(const Report& report) {
    const auto all_bearings = newest_first(report.bearings);
    const auto all_ranges = newest_first(report.ranges);
    auto bearing = all_bearings.begin();
    auto range = all_ranges.begin();
    while (bearing != all_bearings.end() || range != all_ranges.end()) {
      const bool take_range = range != all_ranges.end() && (bearing == all_bearings.end() ||
                                                            (*range)->stamp >= (*bearing)->stamp);
      if (!(take_range ? choose(**range++) : choose(**bearing++))) ++left_out;
    }
  }

  bool choose(const UwbRange& range) {
    if (ranges.size() >= kMaxCount || !reserve_bytes(kRangeSize)) return false;
    ranges.push_back(&range);
    return true;
  }

  bool choose(const Bearing& bearing) {
    if (bearings.size() >= kMaxCount || room_ < kBearingSize + kSourceSize + kCameraSize)
      return false;
    std::size_t cost = kBearingSize;
    const auto camera = index_in(cameras, bearing.p_B_C, kCameraSize, cost);
    if (!camera) return false;
    const auto source = index_in(sources, Source{bearing.neighbor, *camera}, kSourceSize, cost);
    if (!source) return false;
    bearings.push_back({&bearing, *source});
    return reserve_bytes(cost);
  }

  std::int64_t base_tick_;
  std::size_t room_;
};

/// The least e such that |v| <= 32767 * 2^e for all v.
template <class Member>
int exponent_for(const std::vector<const ImuSample*>& samples, Member member) {
  double largest = 0.0;
  for (const ImuSample* sample : samples)
    largest = std::max(largest, (sample->*member).cwiseAbs().maxCoeff());
  int exponent = kMinExponent;
  while (std::ldexp(kMaxCode, exponent) < largest) ++exponent;
  return exponent;
}

class Encoder {
 public:
  Encoder(std::int64_t base_tick, std::size_t max_bytes) : base_tick_(base_tick), out_(max_bytes) {}

  void header(const OutgoingPeerMessage& message) {
    for (const std::uint8_t byte : kMagic) out_.write<std::uint8_t>(byte);
    out_.write<std::uint8_t>(kVersion);
    out_.write<std::uint16_t>(message.report.sender.value);
    out_.write<std::uint32_t>(message.session);
    out_.write<std::uint32_t>(message.sequence);
    out_.write<std::int64_t>(to_ns(message.sent));
    const auto age = ticks_from<std::int32_t>(base_tick_, message.report.stamp);
    CREPES_EXPECT(age, "a report leaves within hours of its stamp");
    out_.write<std::int32_t>(*age);
  }

  void tilt(const Tilt& tilt) {
    const auto age = ticks_from<std::int32_t>(base_tick_, tilt.stamp);
    const bool known =
        age && is_unit(tilt.up_B) && tilt.sigma_rad > 0 && tilt.sigma_rad < kUnknownTiltSigma;
    out_.write<std::int32_t>(age.value_or(0));
    direction(known ? tilt.up_B : Eigen::Vector3d::UnitZ());
    out_.write_float(known ? tilt.sigma_rad : kUnknownTiltSigma);
  }

  void echoes(const std::vector<ClockEcho>& echoes, Timestamp sent) {
    count(echoes.size());
    for (const ClockEcho& echo : echoes) {
      out_.write<std::uint16_t>(echo.peer.value);
      out_.write<std::int64_t>(echo.sent_ns);
      const std::int64_t age_us = (to_ns(sent) - echo.received_ns + 500) / 1000;
      CREPES_EXPECT(std::in_range<std::uint32_t>(age_us), "an echo is of the recent past");
      out_.write<std::uint32_t>(static_cast<std::uint32_t>(age_us));
    }
  }

  void imu(const std::vector<const ImuSample*>& samples) {
    const int gyro = exponent_for(samples, &ImuSample::gyro_radps);
    const int accel = exponent_for(samples, &ImuSample::accel_mps2);
    count(samples.size());
    out_.write<std::int8_t>(static_cast<std::int8_t>(gyro));
    out_.write<std::int8_t>(static_cast<std::int8_t>(accel));
    for (const ImuSample* sample : samples) {
      stamp(sample->stamp);
      for (const double v : sample->gyro_radps) code16(std::ldexp(v, -gyro));
      for (const double v : sample->accel_mps2) code16(std::ldexp(v, -accel));
    }
  }

  void bearings(const Selection& selection) {
    count(selection.cameras.size());
    for (const Eigen::Vector3d& camera : selection.cameras) vector(camera);
    count(selection.sources.size());
    for (const Source& source : selection.sources) {
      out_.write<std::uint16_t>(source.neighbor.value);
      out_.write<std::uint8_t>(source.camera);
    }
    count(selection.bearings.size());
    for (const auto& [bearing, source] : selection.bearings) {
      stamp(bearing->stamp);
      out_.write<std::uint8_t>(source);
      direction(bearing->u_B);
      out_.write<std::uint8_t>(static_cast<std::uint8_t>(kBearingSigma.encode(bearing->sigma_rad)));
    }
  }

  void ranges(const std::vector<const UwbRange*>& ranges) {
    count(ranges.size());
    for (const UwbRange* range : ranges) {
      out_.write<std::uint16_t>(range->neighbor.value);
      stamp(range->stamp);
      out_.write_float(range->range_m);
      power(range->first_path_dbm);
      power(range->received_dbm);
    }
  }

  void estimates(const std::vector<const NeighborEstimate*>& estimates) {
    count(estimates.size());
    for (const NeighborEstimate* estimate : estimates) {
      const Eigen::Quaterniond q = estimate->T_B_N.pose.q.normalized();
      const auto covariance = encode_covariance(estimate->T_B_N.covariance);
      out_.write<std::uint16_t>(estimate->neighbor.value);
      stamp(estimate->stamp);
      vector(estimate->T_B_N.pose.p);
      for (const double v : {q.w(), q.x(), q.y(), q.z()}) code16(v * kMaxCode);
      vector(estimate->v_B_N);
      for (const std::uint16_t sigma : covariance->sigmas) out_.write<std::uint16_t>(sigma);
      for (const std::int16_t entry : covariance->factor) out_.write<std::int16_t>(entry);
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> finished() && {
    out_.write<std::uint32_t>(crc32(out_.bytes()));
    CREPES_EXPECT(out_.ok(), "the selection fits");
    return std::move(out_).release();
  }

 private:
  void count(std::size_t n) { out_.write<std::uint8_t>(static_cast<std::uint8_t>(n)); }
  void stamp(Timestamp t) { out_.write<std::int16_t>(*ticks_from<std::int16_t>(base_tick_, t)); }
  void code16(double v) { out_.write<std::int16_t>(static_cast<std::int16_t>(std::lround(v))); }
  void vector(const Eigen::Vector3d& v) {
    for (const double x : v) out_.write_float(x);
  }
  void direction(const Eigen::Vector3d& u) {
    for (const std::int16_t code : encode_direction(u)) out_.write<std::int16_t>(code);
  }
  void power(double dbm) {
    const double code = std::clamp(-2 * dbm, 0.0, 255.0);
    out_.write<std::uint8_t>(static_cast<std::uint8_t>(std::lround(code)));
  }

  std::int64_t base_tick_;
  ByteWriter out_;
};

}  // namespace
}  // namespace wire

EncodedPeerMessage encode_peer_message(const OutgoingPeerMessage& message, std::size_t max_bytes) {
  CREPES_EXPECT(max_bytes >= wire::kFirst, "what comes before bearings and ranges has room");
  CREPES_EXPECT(wire::is_robot(message.report.sender), "a sender has an id");
  CREPES_EXPECT(std::abs(to_ns(message.sent)) <= wire::kMaxStamp, "a clock counts from its epoch");
  const wire::Selection selection(message, max_bytes);
  wire::Encoder encoder(wire::floor_to_ticks(to_ns(message.sent)), max_bytes);
  encoder.header(message);
  encoder.tilt(message.report.tilt);
  encoder.echoes(selection.echoes, message.sent);
  encoder.imu(selection.imu);
  encoder.bearings(selection);
  encoder.ranges(selection.ranges);
  encoder.estimates(selection.estimates);
  return {std::move(encoder).finished(), selection.left_out, selection.refused};
}

}  // namespace crepes
