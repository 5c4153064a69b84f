#include "estimator/team/belief/motion_image.hpp"

namespace crepes {

void set_covariance_with(const std::vector<MotionImage>& images, const Eigen::MatrixXd& P,
                         MatrixRef with) {
  constexpr int kMotion = FreeMotionAt::kMotion;
  with.setZero();
  for (Eigen::Index first = 0; const MotionImage& image : images) {
    for (const MotionImage::Part& part : image.parts) {
      add_product(P.middleCols(part.from, part.by.cols()), part.by,
                  with.middleCols<kMotion>(first));
    }
    first += kMotion;
  }
}

void set_covariance_of(const std::vector<MotionImage>& images, const ConstMatrixRef& with,
                       MatrixRef own) {
  constexpr int kMotion = FreeMotionAt::kMotion;
  Eigen::MatrixXd of_states;  // with a column for each state of a part, for `add_product`
  for (Eigen::Index first = 0; const MotionImage& image : images) {
    const Eigen::Index end = first + kMotion;
    auto columns = own.block(0, first, end, kMotion);
    columns.setZero();
    for (const MotionImage::Part& part : image.parts) {
      of_states = with.block(part.from, 0, part.by.cols(), end).transpose();
      add_product(of_states, part.by, columns);
    }
    own.block(first, 0, kMotion, first) = columns.topRows(first).transpose();
    auto square = own.block<kMotion, kMotion>(first, first);
    square = (0.5 * (square + square.transpose())).eval();
    first = end;
  }
}

}  // namespace crepes
