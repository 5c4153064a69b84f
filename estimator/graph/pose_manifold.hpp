/// The manifold of poses for Ceres, whatever its version.
#pragma once

#include <ceres/version.h>

#include "estimator/graph/relative_pose_factor.hpp"

// Ubuntu 22.04 has Ceres 2.0, which calls it a local parameterization; from 2.2 on it does not.
#if CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR == 0
#include <ceres/autodiff_local_parameterization.h>
#else
#include <ceres/autodiff_manifold.h>
#endif

namespace crepes {

#if CERES_VERSION_MAJOR == 2 && CERES_VERSION_MINOR == 0

/// `RightPerturbation` as Ceres 2.0 calls it.
struct RightPlus {
  template <class T>
  bool operator()(const T* x, const T* delta, T* x_plus) const {
    return RightPerturbation{}.Plus(x, delta, x_plus);
  }
};
using PoseManifold = ceres::AutoDiffLocalParameterization<RightPlus, kPoseParameters, 6>;

#else

using PoseManifold = ceres::AutoDiffManifold<RightPerturbation, kPoseParameters, 6>;

#endif

}  // namespace crepes
