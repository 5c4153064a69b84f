/// Normal equations of a chain of states with a border of constants.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace crepes {

/// H x = g.  A state shares measurements with the state after it and with the constants, so H is
/// block tridiagonal with a dense border. One Cholesky sweep costs a constant time for each state.
/// `Size` is that of a state, or Eigen::Dynamic.
template <int Size>
class BasicArrowSystem {
 public:
  static constexpr int kState = Size;
  using StateMatrix = Eigen::Matrix<double, Size, Size>;
  using StateVector = Eigen::Matrix<double, Size, 1>;

  /// The solution: one vector a state, and the constants.
  struct Step {
    std::vector<StateVector> states;
    Eigen::VectorXd constants;
    Eigen::MatrixXd constants_covariance;  ///< the inverse of H's Schur complement
  };

  /// `size` is that of a state, which must be said if it is dynamic.
  BasicArrowSystem(std::size_t states, int constants, int size = Size);

  [[nodiscard]] std::size_t states() const { return blocks_.size(); }

  /// The blocks of H and g that a caller adds to.
  StateMatrix& diagonal(std::size_t k) { return blocks_[k].D; }
  StateMatrix& to_next(std::size_t k) { return blocks_[k].E; }  ///< rows k, columns k + 1
  Eigen::MatrixXd& to_constants(std::size_t k) { return blocks_[k].F; }
  StateVector& gradient(std::size_t k) { return blocks_[k].g; }
  Eigen::MatrixXd& constants() { return H_; }
  Eigen::VectorXd& constants_gradient() { return g_; }

  /// Solves with the diagonal multiplied by 1 + `damping` (Marquardt 1963). Empty if H is not
  /// positive definite.
  [[nodiscard]] std::optional<Step> solve(double damping) const;

 private:
  struct Block {
    StateMatrix D;
    StateMatrix E;
    Eigen::MatrixXd F;
    StateVector g;
  };
  std::vector<Block> blocks_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_;
};

extern template class BasicArrowSystem<15>;
extern template class BasicArrowSystem<Eigen::Dynamic>;

/// One body: attitude, velocity, position and the biases of its IMU.
using ArrowSystem = BasicArrowSystem<15>;
/// Several bodies at one instant.
using TeamArrowSystem = BasicArrowSystem<Eigen::Dynamic>;

}  // namespace crepes
