#include "net/mesh/peer_message_quantizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "estimator/core/contract.hpp"
#include "net/mesh/wire_codes.hpp"

namespace crepes::wire {
namespace {

constexpr std::size_t kEchoesPerReport = 3;
constexpr std::size_t kMaxEchoes = 8;
constexpr std::size_t kMaxCameras = 8;
constexpr std::size_t kMaxItems = BodyReader::kMaxItems;

std::int64_t tick_of(Timestamp stamp) { return floor_to_ticks(to_ns(stamp) + kTick / 2); }

std::int64_t rounded(double value, double step) {
  return static_cast<std::int64_t>(std::llround(value / step));
}

bool is_unit(const Eigen::Vector3d& u) { return std::abs(u.norm() - 1) < 1e-3; }

bool is_coordinate(const Eigen::Vector3d& p) {
  return p.allFinite() && p.cwiseAbs().maxCoeff() < kMaxCoordinate;
}

bool is_writable(const ImuSample& sample) {
  const double limit = std::ldexp(static_cast<double>(kMaxImuCode), kMaxExponent - 1);
  return sample.gyro_radps.allFinite() && sample.accel_mps2.allFinite() &&
         sample.gyro_radps.cwiseAbs().maxCoeff() < limit &&
         sample.accel_mps2.cwiseAbs().maxCoeff() < limit;
}

bool is_writable(const Bearing& bearing) {
  return is_robot(bearing.neighbor) && is_unit(bearing.u_B) && is_coordinate(bearing.p_B_C) &&
         bearing.sigma_rad > 0 && std::isfinite(bearing.sigma_rad);
}

bool is_writable(const UwbRange& range) {
  return is_robot(range.neighbor) && range.range_m >= 1e-3 && range.range_m < kMaxRange &&
         std::isfinite(range.first_path_dbm) && std::isfinite(range.received_dbm);
}

bool is_writable(const NeighborEstimate& estimate) {
  const Pose& pose = estimate.T_B_N.pose;
  return is_robot(estimate.neighbor) && is_coordinate(pose.p) && is_coordinate(estimate.v_B_N) &&
         std::abs(pose.q.norm() - 1) < 1e-3 &&
         encode_covariance(estimate.T_B_N.covariance).has_value();
}

/// The exponent of the step: as coarse as allowed, coarser only where a value would not fit.
template <class Member>
int exponent_for(const std::vector<const ImuSample*>& samples, Member member, double coarsest) {
  double largest = 0.0;
  for (const ImuSample* sample : samples)
    largest = std::max(largest, (sample->*member).cwiseAbs().maxCoeff());
  int exponent = std::clamp(std::ilogb(coarsest), kMinExponent, kMaxExponent);
  while (std::ldexp(static_cast<double>(kMaxImuCode), exponent) < largest) ++exponent;
  return exponent;
}

/// Bits of the samples' values of three axes.
std::size_t bits_of(const std::vector<CodedImuSample>& samples, std::size_t first_axis,
                    const Prediction& prediction) {
  std::size_t bits = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    for (std::size_t axis = first_axis; axis < first_axis + 3; ++axis) {
      bits += BitWriter::width_of(
          samples[i].values.at(axis) - predicted_value(samples, i, axis, prediction.is_linear),
          prediction.order);
    }
  }
  return bits;
}

Prediction shortest(const std::vector<CodedImuSample>& samples, std::size_t first_axis) {
  constexpr unsigned kMaxOrder = 15;
  Prediction best;
  std::size_t least = bits_of(samples, first_axis, best);
  for (const bool is_linear : {false, true}) {
    for (unsigned order = 0; order <= kMaxOrder; ++order) {
      const std::size_t bits = bits_of(samples, first_axis, {is_linear, order});
      if (bits < least) {
        least = bits;
        best = {is_linear, order};
      }
    }
  }
  return best;
}

CodedTilt coded_tilt(const Tilt& tilt, std::int64_t age) {
  return {age, encode_direction(tilt.up_B), kTiltSigma.encode(tilt.sigma_rad)};
}

CodedRange coded(const UwbRange& range, std::int64_t age) {
  const auto power = [](double dbm) {
    return std::clamp<std::int64_t>(rounded(dbm, -0.5), 0, kMaxPower);
  };
  return {age, rounded(range.range_m, 1e-3), power(range.received_dbm),
          power(range.first_path_dbm)};
}

CodedEstimate coded(const NeighborEstimate& estimate, std::int64_t age) {
  CodedEstimate code{.neighbor = estimate.neighbor.value, .age = age};
  Eigen::Vector4d q = estimate.T_B_N.pose.q.normalized().coeffs();  // x y z w
  Eigen::Index largest = 0;
  q.cwiseAbs().maxCoeff(&largest);
  if (q[largest] < 0) q = -q;
  code.largest = static_cast<unsigned>(largest);
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < 4; ++i) {
    if (i != largest) {
      code.q.at(next++) =
          rounded(q[i], 1.0 / (std::numbers::sqrt2 * static_cast<double>(kQuaternionUnit)));
    }
  }
  for (int i = 0; i < 3; ++i) {
    code.p.at(static_cast<std::size_t>(i)) = rounded(estimate.T_B_N.pose.p[i], kPlaceStep);
    code.v.at(static_cast<std::size_t>(i)) = rounded(estimate.v_B_N[i], kSpeedStep);
  }
  const auto covariance = encode_covariance(estimate.T_B_N.covariance);
  code.sigmas = covariance->sigmas;
  code.factor = covariance->factor;
  return code;
}

/// All that a datagram might carry, as integers.
class Quantizer {
 public:
  Quantizer(const OutgoingPeerMessage& message, const WireLimits& limits)
      : limits_(limits), base_tick_(floor_to_ticks(to_ns(message.sent))) {
    const Report& report = message.report;
    body_.sent_ns = static_cast<std::uint64_t>(to_ns(message.sent));
    body_.mark = message.mark;
    body_.report_age = age_of(report.stamp);
    CREPES_EXPECT(std::abs(body_.report_age) <= kMaxTiltAge,
                  "a report leaves within hours of its stamp");
    add_tilt(report.tilt);
    add_echoes(message);
    add_imu(report.imu);
    for (const Bearing* bearing : newest_first(report.bearings)) add(*bearing);
    for (const UwbRange* range : newest_first(report.ranges)) add(*range);
    std::ranges::sort(body_.sources, {}, &CodedSource::neighbor);
    add_estimate(report.estimates, turn_of(message));
  }

  [[nodiscard]] CodedBody body() && { return std::move(body_); }
  [[nodiscard]] std::size_t refused() const { return refused_; }

 private:
  [[nodiscard]] std::int64_t age_of(Timestamp stamp) const { return base_tick_ - tick_of(stamp); }

  /// What can be written and is neither too old nor of the future.
  template <class Item>
  std::vector<const Item*> newest_first(const std::vector<Item>& items) {
    std::vector<const Item*> chosen;
    for (const Item& item : items) {
      const std::int64_t age = age_of(item.stamp);
      if (!is_writable(item)) {
        ++refused_;
      } else if (age >= kAges.min && age <= kAges.max) {
        chosen.push_back(&item);
      }
    }
    std::ranges::stable_sort(chosen, std::ranges::greater{},
                             [](const Item* item) { return item->stamp; });
    return chosen;
  }

  void add_tilt(const Tilt& tilt) {
    const bool is_known = is_unit(tilt.up_B) && tilt.sigma_rad > 0 &&
                          tilt.sigma_rad < kUnknownTiltSigma && age_of(tilt.stamp) <= kMaxTiltAge &&
                          age_of(tilt.stamp) >= body_.report_age - kMaxAhead;
    if (is_known) body_.tilt = coded_tilt(tilt, age_of(tilt.stamp));
  }

  /// By turns if there are more peers than room.
  void add_echoes(const OutgoingPeerMessage& message) {
    const std::size_t most = std::min(kEchoesPerReport * limits_.reports, kMaxEchoes);
    const std::size_t count = std::min(message.echoes.size(), most);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t turn = std::size_t{turn_of(message)} * most + i;
      const ClockEcho& echo = message.echoes[turn % message.echoes.size()];
      const std::int64_t age_us = (to_ns(message.sent) - echo.received_ns + 500) / 1000;
      CREPES_EXPECT(std::in_range<std::uint32_t>(age_us), "an echo is of the recent past");
      constexpr auto kMaxLoss = static_cast<double>((1U << kLossBits) - 1);
      const double loss = std::clamp(std::round(echo.loss * kLossSteps), 0.0, kMaxLoss);
      body_.echoes.push_back({echo.peer.value, echo.sent_code, static_cast<std::uint64_t>(age_us),
                              static_cast<unsigned>(loss), echo.is_direct});
    }
  }

  void add_imu(const std::vector<ImuSample>& all) {
    auto samples = newest_first(all);
    const auto copies = static_cast<std::int64_t>(limits_.copies);
    std::erase_if(samples, [&](const ImuSample* sample) {
      return samples.front()->stamp - sample->stamp >= copies * limits_.period &&
             sample->stamp <= limits_.samples_sent;
    });
    if (samples.size() > kMaxItems) samples.resize(kMaxItems);
    if (samples.empty()) return;
    CodedImu& imu = body_.imu;
    imu.gyro_exponent = exponent_for(samples, &ImuSample::gyro_radps, limits_.gyro_step_radps);
    imu.accel_exponent = exponent_for(samples, &ImuSample::accel_mps2, limits_.accel_step_mps2);
    for (const ImuSample* sample : samples) {
      CodedImuSample& code = imu.samples.emplace_back();
      code.age = age_of(sample->stamp);
      for (int i = 0; i < 3; ++i) {
        const auto axis = static_cast<std::size_t>(i);
        code.values.at(axis) = rounded(sample->gyro_radps[i], std::ldexp(1.0, imu.gyro_exponent));
        code.values.at(axis + 3) =
            rounded(sample->accel_mps2[i], std::ldexp(1.0, imu.accel_exponent));
      }
    }
    imu.predictions = {shortest(imu.samples, 0), shortest(imu.samples, 3)};
  }

  CodedSource& source_of(RobotId neighbor) {
    const auto found = std::ranges::find(body_.sources, neighbor.value, &CodedSource::neighbor);
    return found != body_.sources.end()
               ? *found
               : body_.sources.emplace_back(CodedSource{neighbor.value, {}, {}});
  }

  void add(const Bearing& bearing) {
    std::array<std::int64_t, 3> place{};
    for (int i = 0; i < 3; ++i)
      place.at(static_cast<std::size_t>(i)) = rounded(bearing.p_B_C[i], kCameraStep);
    auto camera = std::ranges::find(body_.cameras, place);
    if (camera == body_.cameras.end()) {
      if (body_.cameras.size() == kMaxCameras) return;
      camera = body_.cameras.insert(camera, place);
    }
    CodedSource& source = source_of(bearing.neighbor);
    if (is_full(source.bearings, bearing)) return;
    source.bearings.push_back({.age = age_of(bearing.stamp),
                               .camera = static_cast<std::uint64_t>(camera - body_.cameras.begin()),
                               .u = encode_direction(bearing.u_B),
                               .sigma = kBearingSigma.encode(bearing.sigma_rad)});
  }

  void add(const UwbRange& range) {
    CodedSource& source = source_of(range.neighbor);
    if (!is_full(source.ranges, range)) source.ranges.push_back(coded(range, age_of(range.stamp)));
  }

  /// Whether the list has all copies that are due. A mirror image has the stamp of its board.
  template <class Code, class Item>
  [[nodiscard]] bool is_full(const std::vector<Code>& codes, const Item& item) const {
    if (codes.empty()) return false;
    const auto window = static_cast<std::int64_t>(limits_.copies) * limits_.period;
    return codes.size() == kMaxItems ||
           (age_of(item.stamp) - codes.front().age) * kTick >= window.count();
  }

  void add_estimate(const std::vector<NeighborEstimate>& all, std::uint32_t turn) {
    std::vector<const NeighborEstimate*> estimates = newest_first(all);
    if (estimates.empty()) return;
    std::ranges::sort(estimates, {}, [](const auto* estimate) { return estimate->neighbor; });
    const NeighborEstimate& next = *estimates[turn % estimates.size()];
    body_.estimates.push_back(coded(next, age_of(next.stamp)));
  }

  const WireLimits& limits_;
  std::int64_t base_tick_;
  CodedBody body_;
  std::size_t refused_ = 0;
};

}  // namespace

QuantizedMessage quantized(const OutgoingPeerMessage& message, const WireLimits& limits) {
  Quantizer quantizer(message, limits);
  const std::size_t refused = quantizer.refused();
  return {std::move(quantizer).body(), refused};
}

}  // namespace crepes::wire
