/// How far the clocks of two devices drift apart: each runs on a crystal.
#pragma once

namespace crepes {

inline constexpr double kSkewPrior = 50e-6;  ///< one sigma of a crystal against another
inline constexpr double kMaxSkew = 200e-6;   ///< no two differ by more

}  // namespace crepes
