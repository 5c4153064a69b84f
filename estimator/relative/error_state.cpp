#include "estimator/relative/error_state.hpp"

#include "estimator/relative/polar_error.hpp"

namespace crepes {

void inject(const ErrorState::Vector& dx, NominalState& state) {
  using E = ErrorState;
  state.motion = corrected(state.motion, dx.head<E::kMotion>());
  state.bias_B.gyro_radps += dx.segment<3>(E::kGyroB);
  state.bias_B.accel_mps2 += dx.segment<3>(E::kAccelB);
  state.bias_N.gyro_radps += dx.segment<3>(E::kGyroN);
  state.bias_N.accel_mps2 += dx.segment<3>(E::kAccelN);
  state.bias_B.gyro_scale.reshaped() += dx.segment<9>(E::kGyroScaleB);
  state.bias_N.gyro_scale.reshaped() += dx.segment<9>(E::kGyroScaleN);
  state.range_bias_m += dx(E::kRangeBias);
  state.misalignment_B += dx.segment<3>(E::kMisalignB);
  state.misalignment_N += dx.segment<3>(E::kMisalignN);
  state.bias_B.accel_scale.reshaped() += dx.segment<9>(E::kAccelScaleB);
  state.bias_N.accel_scale.reshaped() += dx.segment<9>(E::kAccelScaleN);
}

}  // namespace crepes
