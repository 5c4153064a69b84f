#include "tests/soak/soak_device.hpp"

#include <algorithm>
#include <utility>

#include "estimator/core/contract.hpp"

namespace crepes {

namespace fs = std::filesystem;

SoakDevice::SoakDevice(fs::path link, std::vector<double> rates_hz, Frame frame, unsigned seed,
                       Timestamp now)
    : link_(std::move(link)),
      rates_hz_(std::move(rates_hz)),
      frame_(std::move(frame)),
      random_(seed),
      over_(now) {
  period_ = from_seconds(1.0 / rates_hz_.front());
  plug(now);
}

Duration SoakDevice::between(double least_s, double most_s) {
  return from_seconds(std::uniform_real_distribution<>(least_s, most_s)(random_));
}

/// The link appears when the line is there, as with udev.
void SoakDevice::plug(Timestamp now) {
  Result<PseudoTerminal> line = PseudoTerminal::open();
  CREPES_EXPECT(line.has_value(), "a machine with pseudo-terminals");
  line_ = std::move(*line);
  const fs::path fresh = link_.string() + ".new";
  fs::create_symlink(line_->path(), fresh);
  fs::rename(fresh, link_);
  plugged_ = now;
  next_frame_ = now;
}

void SoakDevice::begin_mishap(Timestamp now) {
  mishap_ = static_cast<Mishap>(std::uniform_int_distribution<>(1, 5)(random_));
  last_mishap_ = mishap_;
  next_change_ = now + between(0.05, 3.0);
  if (mishap_ != Mishap::kUnplugged) return;
  fs::remove(link_);
  line_.reset();
}

void SoakDevice::end_mishap(Timestamp now) {
  if (mishap_ == Mishap::kUnplugged) plug(now);
  mishap_ = Mishap::kNone;
  over_ = now;
  recovering_ = true;
  next_frame_ = now;
  const auto rate = std::uniform_int_distribution<std::size_t>(0, rates_hz_.size() - 1)(random_);
  period_ = from_seconds(1.0 / rates_hz_[rate]);
}

void SoakDevice::step(Timestamp now) {
  if (mishap_ != Mishap::kNone && now >= next_change_) {
    end_mishap(now);
  } else if (is_well() && now >= next_change_ && !is_calm_) {
    begin_mishap(now);
  }
  for (; next_frame_ <= now; next_frame_ += period_) send(now);
}

void SoakDevice::send(Timestamp now) {
  const auto time_ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(now - plugged_).count();
  std::vector<std::uint8_t> bytes = frame_(++number_, static_cast<std::uint32_t>(time_ms));
  const auto below = [&](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_);
  };
  switch (mishap_) {
    case Mishap::kNone:
      break;
    case Mishap::kUnplugged:
    case Mishap::kStalled:
      return;
    case Mishap::kGarbage:
      std::ranges::generate(bytes, [&] { return static_cast<std::uint8_t>(below(256)); });
      break;
    case Mishap::kTorn:
      bytes.resize(below(bytes.size()));
      break;
    case Mishap::kFlipped:
      bytes[below(bytes.size())] ^= static_cast<std::uint8_t>(1U << below(8));
      break;
  }
  line_->write(bytes);
}

std::optional<Recovery> SoakDevice::heard(Timestamp stamp, Timestamp now,
                                          Timestamp reported_since) {
  if (!recovering_ || mishap_ != Mishap::kNone || stamp < over_) return std::nullopt;
  recovering_ = false;
  well_since_ = now;
  next_change_ = now + between(0.2, 1.5);
  return Recovery{last_mishap_, now - std::max(over_, reported_since)};
}

std::optional<Duration> SoakDevice::waiting(Timestamp now) const {
  if (mishap_ != Mishap::kNone || !recovering_) return std::nullopt;
  return now - over_;
}

}  // namespace crepes
