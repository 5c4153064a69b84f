/// The recent on/off observations of a source, and their likelihood for a source that is no board.
#pragma once

#include <array>
#include <vector>

#include "estimator/core/time.hpp"

namespace crepes {

/// Whether a source was lit in one frame.
struct BlinkObservation {
  Timestamp stamp{};
  bool lit = false;
};

/// The latest observations in time order, at most kCapacity of them, with the counts of their
/// steps. Allocates once.
class BlinkWindow {
 public:
  static constexpr std::size_t kCapacity = 320;
  /// [lit before][lit now]: how often one followed the other.
  using Steps = std::array<std::array<int, 2>, 2>;

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool is_full() const { return size_ == kCapacity; }
  /// The i-th oldest.
  [[nodiscard]] const BlinkObservation& operator[](std::size_t i) const {
    return ring_[(first_ + i) % kCapacity];
  }
  [[nodiscard]] const Steps& steps() const { return steps_; }

  /// The window must not be full.
  void push(BlinkObservation observation);
  /// Drops the oldest; there must be one.
  void pop();
  void clear();

 private:
  std::vector<BlinkObservation> ring_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  Steps steps_{};
};

/// The likelihood of a window under a two-state Markov chain, its rates integrated out
/// (Krichevsky-Trofimov).
class MarkovLikelihood {
 public:
  MarkovLikelihood();
  [[nodiscard]] double log_of(const BlinkWindow::Steps& steps) const;

 private:
  std::vector<double> log_gamma_half_;  ///< ln Gamma(n + 1/2)
  std::vector<double> log_factorial_;   ///< ln n!
};

}  // namespace crepes
