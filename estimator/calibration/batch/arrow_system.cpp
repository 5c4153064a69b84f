#include "estimator/calibration/batch/arrow_system.hpp"

#include <Eigen/Cholesky>

namespace crepes {

template <int Size>
BasicArrowSystem<Size>::BasicArrowSystem(std::size_t states, int constants, int size)
    : blocks_(states),
      H_(Eigen::MatrixXd::Zero(constants, constants)),
      g_(Eigen::VectorXd::Zero(constants)) {
  for (Block& block : blocks_) {
    block.D = StateMatrix::Zero(size, size);
    block.E = StateMatrix::Zero(size, size);
    block.F = Eigen::MatrixXd::Zero(size, constants);
    block.g = StateVector::Zero(size);
  }
}

template <int Size>
std::optional<typename BasicArrowSystem<Size>::Step> BasicArrowSystem<Size>::solve(
    double damping) const {
  std::vector<Block> chain = blocks_;
  Eigen::MatrixXd H = H_;
  Eigen::VectorXd g = g_;
  for (Block& block : chain) block.D.diagonal() *= 1.0 + damping;
  H.diagonal() *= 1.0 + damping;

  // Each state, from the first, is expressed by the one after it and the constants; E, F and g
  // then hold D^-1 E, D^-1 F and D^-1 g.
  for (std::size_t k = 0; k < chain.size(); ++k) {
    Block& block = chain[k];
    const Eigen::LLT<StateMatrix> chol(block.D);
    if (chol.info() != Eigen::Success) return std::nullopt;
    const StateMatrix E = block.E;
    const Eigen::MatrixXd F = block.F;
    block.E = chol.solve(E);
    block.F = chol.solve(F);
    block.g = chol.solve(block.g);
    H.noalias() -= F.transpose() * block.F;
    g.noalias() -= F.transpose() * block.g;
    if (k + 1 == chain.size()) break;
    chain[k + 1].D.noalias() -= E.transpose() * block.E;
    chain[k + 1].F.noalias() -= E.transpose() * block.F;
    chain[k + 1].g.noalias() -= E.transpose() * block.g;
  }
  const Eigen::LLT<Eigen::MatrixXd> chol(H);
  if (chol.info() != Eigen::Success) return std::nullopt;
  Step step;
  step.constants = chol.solve(g);
  step.constants_covariance = chol.solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
  step.states.resize(chain.size());
  for (std::size_t k = chain.size(); k-- > 0;) {
    step.states[k] = chain[k].g - chain[k].F * step.constants;
    if (k + 1 < chain.size()) step.states[k] -= chain[k].E * step.states[k + 1];
  }
  return step;
}

template class BasicArrowSystem<15>;
template class BasicArrowSystem<Eigen::Dynamic>;

}  // namespace crepes
