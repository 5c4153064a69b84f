/// The normal equations of a camera calibration.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"
#include "estimator/calibration/camera/camera_factors.hpp"
#include "estimator/calibration/camera/camera_state.hpp"
#include "estimator/calibration/camera/local_state.hpp"

namespace crepes {

/// Builds  J^T J x = -J^T r  of all residuals r that `CameraProblem` shows it, in sigmas.
class CameraLinearization {
 public:
  /// Adds to `system`, which outlives it. `constants` say how boards move.
  CameraLinearization(const CameraConstants& constants, ArrowSystem& system);

  /// From a knot to the next, whitened, with the derivative by the next.
  void imu(std::size_t knot, const Eigen::Matrix<LocalJet, ArrowSystem::kState, 1>& r,
           const ArrowSystem::StateMatrix& J_next);
  /// Of a board's spot.
  void sighting(std::size_t knot, std::size_t /*index*/, std::size_t board, const SpotRow& row,
                double weight);
  /// A sighting that the lens cannot show has no derivative.
  void invalid(double /*cost*/) {}
  /// A prior of a constant: its residual, and the derivative.
  void prior_of_constant(int index, double r, double slope);
  /// A prior of the first knot.
  void prior_of_first(const Eigen::Matrix<double, 1, ArrowSystem::kState>& row, double r);

 private:
  static constexpr int kState = ArrowSystem::kState;
  static constexpr int kLocal = local_columns::kSize;
  static constexpr int kShared = camera_constants::kBoards;  ///< constants without boards

  /// The unknowns that move a board, and the derivative of its place by them.
  struct BoardColumns {
    Eigen::Index begin = 0;  ///< among the constants
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kRigidUnknowns> J;
  };
  [[nodiscard]] static BoardColumns columns_of(const CameraConstants& constants, std::size_t board);
  /// To the blocks of a knot and of the constants without boards.
  template <class H, class B>
  void add_local(std::size_t knot, const H& hessian, const B& slope);

  ArrowSystem& system_;
  std::vector<BoardColumns> boards_;
};

}  // namespace crepes
