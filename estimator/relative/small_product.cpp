#include "estimator/relative/small_product.hpp"

#include <cstring>

#include "estimator/core/contract.hpp"

namespace crepes {
namespace {

using Eigen::Index;

// C += A B^T or C -= A B^T; strides are from column to column.
struct Operands {
  const double* A;
  const double* B;
  double* C;
  Index stride_A;
  Index stride_B;
  Index stride_C;
  Index rows;
  Index columns;
  Index inner;
};

// A tile of C from (i, j) on, kVectors high and kColumns wide, which registers hold meanwhile.
// NOLINTBEGIN(modernize-avoid-c-arrays): an array class loses what makes these vectors.
template <bool kAdd, Index kLanes, Index kVectors, Index kColumns>
[[gnu::always_inline]] inline void do_tile(Operands x, Index i, Index j) {
  using Lanes [[gnu::vector_size(kLanes * sizeof(double))]] = double;
  const double* a = x.A + i;
  const double* b = x.B + j;
  double* c = x.C + i + j * x.stride_C;
  Lanes sum[kColumns][kVectors];
#pragma GCC unroll 6
  for (Index m = 0; m < kColumns; ++m) {
#pragma GCC unroll 6
    for (Index v = 0; v < kVectors; ++v)
      std::memcpy(&sum[m][v], c + m * x.stride_C + v * kLanes, sizeof(Lanes));
  }
  for (Index k = 0; k < x.inner; ++k) {
    Lanes column[kVectors];
#pragma GCC unroll 6
    for (Index v = 0; v < kVectors; ++v)
      std::memcpy(&column[v], a + k * x.stride_A + v * kLanes, sizeof(Lanes));
#pragma GCC unroll 6
    for (Index m = 0; m < kColumns; ++m) {
#pragma GCC unroll 6
      for (Index v = 0; v < kVectors; ++v) {
        const Lanes product = b[k * x.stride_B + m] * column[v];
        sum[m][v] = kAdd ? sum[m][v] + product : sum[m][v] - product;
      }
    }
  }
#pragma GCC unroll 6
  for (Index m = 0; m < kColumns; ++m) {
#pragma GCC unroll 6
    for (Index v = 0; v < kVectors; ++v)
      std::memcpy(c + m * x.stride_C + v * kLanes, &sum[m][v], sizeof(Lanes));
  }
}
// NOLINTEND(modernize-avoid-c-arrays)

template <bool kAdd, Index kLanes, Index kVectors, Index kColumns>
[[gnu::always_inline]] inline void do_product(Operands x) {
  if (x.rows == 0 || x.inner == 0) return;  // an empty matrix has no address to count from
  constexpr Index kTall = kVectors * kLanes;
  const Index tall = x.rows / kTall * kTall;
  Index j = 0;
  for (; j + 2 * kColumns <= x.columns; j += 2 * kColumns) {
    for (Index i = 0; i < tall; i += kTall) do_tile<kAdd, kLanes, kVectors, 2 * kColumns>(x, i, j);
  }
  for (; j + kColumns <= x.columns; j += kColumns) {
    for (Index i = 0; i < tall; i += kTall) do_tile<kAdd, kLanes, kVectors, kColumns>(x, i, j);
  }
  for (; j < x.columns; ++j) {
    for (Index i = 0; i < tall; i += kTall) do_tile<kAdd, kLanes, kVectors, 1>(x, i, j);
  }
  for (j = 0; j < x.columns; ++j) {
    for (Index i = tall; i < x.rows; ++i) {
      double sum = x.C[i + j * x.stride_C];
      for (Index k = 0; k < x.inner; ++k) {
        const double product = x.B[j + k * x.stride_B] * x.A[i + k * x.stride_A];
        sum = kAdd ? sum + product : sum - product;
      }
      x.C[i + j * x.stride_C] = sum;
    }
  }
}

#ifdef __x86_64__
// Any x86-64 has two lanes, most have four. Not "fma": it rounds in another way than those without.
template <bool kAdd>
[[gnu::target("avx2")]] void do_wide_product(Operands x) {
  do_product<kAdd, 4, 2, 3>(x);
}
#endif

template <bool kAdd>
void do_narrow_product(Operands x) {
  do_product<kAdd, 2, 4, 2>(x);
}

template <bool kAdd>
void do_best_product(Operands x) {
#ifdef __x86_64__
  static const bool is_wide = __builtin_cpu_supports("avx2") != 0;
  if (is_wide) return do_wide_product<kAdd>(x);
#endif
  do_narrow_product<kAdd>(x);
}

Operands operands(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef& C) {
  CREPES_EXPECT(A.rows() == C.rows() && B.rows() == C.cols() && A.cols() == B.cols(),
                "factors fit each other");
  return {A.data(),        B.data(), C.data(), A.outerStride(), B.outerStride(),
          C.outerStride(), C.rows(), C.cols(), A.cols()};
}

}  // namespace

void add_product(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C) {
  do_best_product<true>(operands(A, B, C));
}

void subtract_product(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C) {
  do_best_product<false>(operands(A, B, C));
}

void add_product_narrow(const ConstMatrixRef& A, const ConstMatrixRef& B, MatrixRef C) {
  do_narrow_product<true>(operands(A, B, C));
}

}  // namespace crepes
