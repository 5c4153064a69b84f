#include "estimator/team/belief/team_state.hpp"

#include "estimator/core/so3.hpp"

namespace crepes {

Eigen::Vector3d TeamCamera::seen(const Eigen::Vector3d& u) const {
  const Eigen::Vector3d turned = so3_exp(misalignment) * u;
  return (turned + lens - turned.dot(lens) * turned).normalized();
}

}  // namespace crepes
