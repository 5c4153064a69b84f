#include "estimator/calibration/swarm/swarm_rows.hpp"

namespace crepes {

void add_rows(const Eigen::Ref<const Eigen::MatrixXd>& rows, std::span<const Columns> all,
              TeamArrowSystem& system) {
  const Eigen::MatrixXd N = rows.transpose() * rows;
  const Eigen::Index last = rows.cols() - 1;
  for (const Columns& a : all) {
    const auto slope = N.block(a.begin, last, a.size, 1);
    if (a.knot == Columns::kConstants) {
      system.constants_gradient().segment(a.where, a.size) -= slope;
    } else {
      system.gradient(a.knot).segment(a.where, a.size) -= slope;
    }
    for (const Columns& b : all) {
      const auto H = N.block(a.begin, b.begin, a.size, b.size);
      if (a.knot == Columns::kConstants) {
        if (b.knot == Columns::kConstants)
          system.constants().block(a.where, b.where, a.size, b.size) += H;
      } else if (b.knot == Columns::kConstants) {
        system.to_constants(a.knot).block(a.where, b.where, a.size, b.size) += H;
      } else if (a.knot == b.knot) {
        system.diagonal(a.knot).block(a.where, b.where, a.size, b.size) += H;
      } else if (a.knot + 1 == b.knot) {
        system.to_next(a.knot).block(a.where, b.where, a.size, b.size) += H;
      }
    }
  }
}

}  // namespace crepes
