#include "net/mesh/clock_offset.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "estimator/core/contract.hpp"
#include "estimator/core/crystal_skew.hpp"

namespace crepes {
namespace {

constexpr double kUsableSigma = 5e-3;  // s
constexpr double kSigmaFloor = 20e-6;  // s: the two directions are never equally fast
constexpr double kTolerance = 5e-3;    // s: bounds that cross by more contradict each other
constexpr double kMaxDelay = 10.0;     // s: no packet is older
constexpr int kContradictions = 3;     // consecutive: no longer an outlier
constexpr double kSettling = 2.5;      // s after the first use during which corrections are steps
constexpr double kDependence = 1.5;    // echo windows overlap: fewer echoes are independent
constexpr double kMaxSlew = 1e-3;      // s/s
constexpr double kSlewTime = 1.0;      // s
constexpr double kMaxCorrection = 20e-3;  // s: more is stepped, because slewing would be too slow
constexpr Duration kRecent = std::chrono::milliseconds{500};
constexpr std::size_t kMaxRecent = 256;  // packets of that time; a peer sends 50

using OffsetBounds = std::vector<OffsetBound>;

ClockOffset::Verdict contradicted(int& in_a_row) {
  using Verdict = ClockOffset::Verdict;
  return ++in_a_row < kContradictions ? Verdict::kImplausible : Verdict::kRestarted;
}

}  // namespace

void ClockOffset::begin_anew() { *this = ClockOffset{}; }

double ClockOffset::seconds(Timestamp t) const { return to_seconds(t - *origin_); }

/// Approximate for large differences, exact to the nanosecond for small ones. Never overflows for
/// stamps within +-4e18 ns.
double ClockOffset::offset_seconds(PeerTimestamp peer, Timestamp ours) const {
  const std::int64_t offset_ns = to_ns(peer) - to_ns(ours);
  const double rough = static_cast<double>(offset_ns) - static_cast<double>(base_.count());
  if (std::abs(rough) > 1e18) return rough * 1e-9;
  return static_cast<double>(offset_ns - base_.count()) * 1e-9;
}

bool ClockOffset::is_plausible(double t, double low, double high) const {
  if (!fit_) return std::abs(low) < kMaxDelay && std::abs(high) < kMaxDelay;
  const double sigma =
      std::hypot(fit_->offset_sigma, fit_->skew_sigma * (t - fit_->center), correction_);
  const double tolerance = kTolerance + 4 * sigma;
  return low < fit_->at(t) + tolerance && low > fit_->at(t) - kMaxDelay &&
         high > fit_->at(t) - tolerance && high < fit_->at(t) + kMaxDelay;
}

ClockOffset::Verdict ClockOffset::add_packet(const PacketTimes& packet) {
  if (origin_ && seconds(packet.arrival) > now_ + BoundEnvelope::kWindow) begin_anew();
  if (!origin_) {
    origin_ = packet.arrival;
    base_ = Duration{to_ns(packet.sent) - to_ns(packet.arrival)};
  }
  const OffsetBound bound{seconds(packet.arrival), offset_seconds(packet.sent, packet.arrival)};
  const double middle = fit_ ? fit_->at(bound.t) : 0.0;
  if (!is_plausible(bound.t, bound.offset, middle)) {
    const Verdict verdict = contradicted(early_packets_);
    if (verdict == Verdict::kRestarted) {
      begin_anew();
      add_packet(packet);
    }
    return verdict;
  }
  early_packets_ = 0;
  now_ = std::max(now_, bound.t);
  std::erase_if(recent_, [&](const auto& p) { return p.arrival < packet.arrival - kRecent; });
  if (recent_.size() == kMaxRecent) recent_.erase(recent_.begin());
  recent_.push_back(packet);
  if (lower_.offer(bound, fit_ ? fit_->skew : 0.0)) refit();
  advance();
  return Verdict::kUsed;
}

ClockOffset::Verdict ClockOffset::add_echo(Timestamp sent, PeerTimestamp arrival, Timestamp now) {
  if (!origin_) return Verdict::kImplausible;
  const PacketTimes echo{arrival, sent};
  if (echo.sent == last_echo_.sent && echo.arrival == last_echo_.arrival) return Verdict::kUsed;
  last_echo_ = echo;
  const OffsetBound bound{seconds(sent), offset_seconds(arrival, sent)};
  const double middle = fit_ ? fit_->at(bound.t) : 0.0;
  if (!is_plausible(bound.t, middle, bound.offset)) {
    const Verdict verdict = contradicted(early_echoes_);
    if (verdict == Verdict::kRestarted) begin_anew();
    return verdict;
  }
  early_echoes_ = 0;
  now_ = std::max(now_, seconds(now));
  if (upper_.offer(bound, fit_ ? fit_->skew : 0.0)) refit();
  advance();
  return Verdict::kUsed;
}

/// The line with the widest margin between upper and lower bounds, under a prior on its slope:
///   max over k of  (min_j (u_j - k t_j) - max_i (l_i - k t_i)) / scale - k^2 / (2 sigma_k^2)
/// with times from the middle of the window.
void ClockOffset::refit() {
  const OffsetBounds lower = lower_.bounds(now_);
  const OffsetBounds upper = upper_.bounds(now_);
  if (lower.empty() || upper.empty()) return;

  const auto earlier = [](const OffsetBound& a, const OffsetBound& b) { return a.t < b.t; };
  const auto [first_lower, last_lower] = std::minmax_element(lower.begin(), lower.end(), earlier);
  const auto [first_upper, last_upper] = std::minmax_element(upper.begin(), upper.end(), earlier);
  const double begin = std::max(first_lower->t, first_upper->t);
  const double end = std::min(last_lower->t, last_upper->t);
  const double center = (begin + end) / 2;
  const auto margin = [&](double skew) {
    return tightest(upper, skew, center, -1) - tightest(lower, skew, center, +1);
  };

  const double guess = fit_ ? fit_->skew : 0.0;
  const auto sigmas = [&](double skew) {
    const double gap = margin(skew);
    return std::pair{envelope_sigma(lower, skew, center, tightest(lower, skew, center, +1), gap),
                     envelope_sigma(upper, skew, center, tightest(upper, skew, center, -1), gap)};
  };
  const auto [guess_lower, guess_upper] = sigmas(guess);
  const double scale = std::max((guess_lower + guess_upper) / 2, 1e-7);
  const double skew = maximizer(-kMaxSkew, kMaxSkew, [&](double k) {
    return margin(k) / scale - 0.5 * (k / kSkewPrior) * (k / kSkewPrior);
  });

  const double low = tightest(lower, skew, center, +1);
  const double high = tightest(upper, skew, center, -1);
  if (high - low < -kTolerance) return begin_anew();  // the bounds belong to two different clocks

  const auto [lower_sigma, upper_sigma] = sigmas(skew);
  const double offset_sigma = kDependence * std::hypot(lower_sigma, upper_sigma) / 2;
  const double span = std::max(end - begin, 0.0);
  const double slope_information = span / (4 * std::max(lower_sigma + upper_sigma, 1e-7));
  const Line line{.offset = (low + high) / 2,
                  .skew = skew,
                  .center = center,
                  .offset_sigma = offset_sigma,
                  .skew_sigma = 1 / std::hypot(1 / kSkewPrior, slope_information)};
  if (fit_) correction_ += fit_->at(now_) - line.at(now_);
  fit_ = line;
}

/// Applies the correction: by steps while the clock is new, slowly afterwards, because stamps that
/// jump look like motion.
void ClockOffset::advance() {
  const double elapsed = now_ - published_until_;
  published_until_ = now_;
  const bool settling = !usable_since_ || now_ - *usable_since_ < kSettling;
  if (settling || std::abs(correction_) > kMaxCorrection) {
    correction_ = 0.0;
  } else {
    const double decayed = correction_ * (1 - std::exp(-elapsed / kSlewTime));
    correction_ -= std::clamp(decayed, -kMaxSlew * elapsed, kMaxSlew * elapsed);
  }
  if (!usable_since_ && is_usable()) usable_since_ = now_;
}

bool ClockOffset::is_usable() const {
  const auto now = estimate();
  return now && now->sigma_s < kUsableSigma;
}

std::optional<ClockEstimate> ClockOffset::estimate() const {
  if (!fit_) return std::nullopt;
  const double skew_part = fit_->skew_sigma * (now_ - fit_->center);
  return ClockEstimate{
      .offset_s = to_seconds(base_) + fit_->at(now_) + correction_,
      .skew = fit_->skew,
      .sigma_s = std::hypot(std::hypot(fit_->offset_sigma, skew_part, correction_), kSigmaFloor)};
}

/// Solves  stamp = t + o(t)  for t.
Timestamp ClockOffset::to_local(PeerTimestamp stamp) const {
  CREPES_EXPECT(fit_.has_value(), "the clock must be known");
  const Duration since_origin{to_ns(stamp) - to_ns(*origin_) - base_.count()};
  const double t =
      fit_->center +
      (to_seconds(since_origin) - fit_->center - fit_->offset - correction_) / (1 + fit_->skew);
  return *origin_ + Duration{std::llround(t * 1e9)};
}

std::optional<PacketTimes> ClockOffset::fastest_recent_packet() const {
  if (recent_.empty()) return std::nullopt;
  const double skew = fit_ ? fit_->skew : 0.0;
  const auto bound = [&](const PacketTimes& p) {
    return offset_seconds(p.sent, p.arrival) - skew * seconds(p.arrival);
  };
  return *std::max_element(recent_.begin(), recent_.end(),
                           [&](const auto& a, const auto& b) { return bound(a) < bound(b); });
}

}  // namespace crepes
