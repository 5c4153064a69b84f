#include "estimator/team/motion_image.hpp"

#include "estimator/relative/small_product.hpp"

namespace crepes {

Eigen::MatrixXd covariance_with(const std::vector<MotionImage>& images, const Eigen::MatrixXd& P) {
  constexpr int kMotion = FreeMotionAt::kMotion;
  Eigen::MatrixXd result =
      Eigen::MatrixXd::Zero(P.rows(), kMotion * static_cast<Eigen::Index>(images.size()));
  for (Eigen::Index first = 0; const MotionImage& image : images) {
    for (const MotionImage::Part& part : image.parts)
      add_product(P.middleCols(part.from, part.by.cols()), part.by,
                  result.middleCols<kMotion>(first));
    first += kMotion;
  }
  return result;
}

}  // namespace crepes
