/// Ceres' numbers that carry derivatives, by name alone: its headers stay in .cpp files.
#pragma once

namespace ceres {

/// A value `a` and its derivatives `v` by N parameters; defined in <ceres/jet.h>.
template <typename T, int N>
struct Jet;

}  // namespace ceres
