#include "estimator/vision/decoding/blink_window.hpp"

#include <cmath>
#include <numbers>

#include "estimator/core/contract.hpp"

namespace crepes {

void BlinkWindow::push(BlinkObservation observation) {
  CREPES_EXPECT(!is_full(), "the oldest was dropped before");
  if (ring_.empty()) ring_.resize(kCapacity);
  if (size_ > 0) ++steps_[(*this)[size_ - 1].lit ? 1 : 0][observation.lit ? 1 : 0];
  ring_[(first_ + size_) % kCapacity] = observation;
  ++size_;
}

void BlinkWindow::pop() {
  CREPES_EXPECT(size_ > 0, "there is one to drop");
  if (size_ > 1) --steps_[(*this)[0].lit ? 1 : 0][(*this)[1].lit ? 1 : 0];
  first_ = (first_ + 1) % kCapacity;
  --size_;
}

void BlinkWindow::clear() {
  first_ = 0;
  size_ = 0;
  steps_ = {};
}

MarkovLikelihood::MarkovLikelihood()
    : log_gamma_half_{0.5 * std::log(std::numbers::pi)}, log_factorial_{0.0} {
  for (std::size_t n = 1; n <= BlinkWindow::kCapacity; ++n) {
    log_gamma_half_.push_back(log_gamma_half_.back() + std::log(static_cast<double>(n) - 0.5));
    log_factorial_.push_back(log_factorial_.back() + std::log(static_cast<double>(n)));
  }
}

/// ln prod_s Gamma(a + 1/2) Gamma(b + 1/2) / (pi (a + b)!),  a and b the steps from s to dark and
/// to lit.
double MarkovLikelihood::log_of(const BlinkWindow::Steps& steps) const {
  double sum = 0.0;
  for (const auto& [dark, lit] : steps) {
    const auto a = static_cast<std::size_t>(dark);
    const auto b = static_cast<std::size_t>(lit);
    sum += log_gamma_half_[a] + log_gamma_half_[b] - log_factorial_[a + b] -
           std::log(std::numbers::pi);
  }
  return sum;
}

}  // namespace crepes
