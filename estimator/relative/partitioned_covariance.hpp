/// A covariance of which measurements see the first states only.
#pragma once

#include <Eigen/Core>

namespace crepes {

/// N error states: measurements see the first S, the others are hidden. Three blocks are stored:
///
///     seen    -            S x S, symmetric, both halves
///     cross   hidden       (N - S) x S and (N - S) x (N - S), symmetric, both halves
///
/// The mirror image of `cross` is not stored: corrections and propagation need not write it. An
/// element there cannot be addressed; fixed-size blocks are checked at compile time.
template <int S, int N>
class PartitionedCovariance {
 public:
  static constexpr int kSeen = S;
  static constexpr int kHidden = N - S;
  using Full = Eigen::Matrix<double, N, N>;

  PartitionedCovariance() : storage_(Full::Zero()) {}
  /// Of a symmetric matrix.
  explicit PartitionedCovariance(const Full& full) : storage_(full) {}

  [[nodiscard]] auto seen() { return storage_.template topLeftCorner<S, S>(); }
  [[nodiscard]] auto seen() const { return storage_.template topLeftCorner<S, S>(); }
  [[nodiscard]] auto cross() { return storage_.template bottomLeftCorner<kHidden, S>(); }
  [[nodiscard]] auto cross() const { return storage_.template bottomLeftCorner<kHidden, S>(); }
  [[nodiscard]] auto hidden() { return storage_.template bottomRightCorner<kHidden, kHidden>(); }
  [[nodiscard]] auto hidden() const {
    return storage_.template bottomRightCorner<kHidden, kHidden>();
  }

  /// Of all N states with the seen ones: `seen` above `cross`.
  [[nodiscard]] auto seen_columns() { return storage_.template leftCols<S>(); }
  [[nodiscard]] auto seen_columns() const { return storage_.template leftCols<S>(); }
  /// Of the hidden states with all N: `cross` beside `hidden`.
  [[nodiscard]] auto hidden_rows() const { return storage_.template bottomRows<kHidden>(); }

  /// Of all N states with the seen states [kFirst, kFirst + kCount).
  template <int kFirst, int kCount>
  [[nodiscard]] auto columns() {
    static_assert(kFirst >= 0 && kFirst + kCount <= S, "columns of seen states");
    return storage_.template middleCols<kCount>(kFirst);
  }
  template <int kFirst, int kCount>
  [[nodiscard]] auto columns() const {
    static_assert(kFirst >= 0 && kFirst + kCount <= S, "columns of seen states");
    return storage_.template middleCols<kCount>(kFirst);
  }
  /// Of seen states with seen states, rows from kFirst on.
  template <int kFirst, int kCount>
  [[nodiscard]] auto seen_rows() {
    static_assert(kFirst >= 0 && kFirst + kCount <= S, "rows of seen states");
    return storage_.template block<kCount, S>(kFirst, 0);
  }
  /// A block that is stored.
  template <int kRow, int kColumn, int kRows, int kColumns>
  [[nodiscard]] auto block() const {
    check_is_stored<kRow, kColumn, kRows, kColumns>();
    return storage_.template block<kRows, kColumns>(kRow, kColumn);
  }
  [[nodiscard]] auto diagonal() { return storage_.diagonal(); }
  [[nodiscard]] auto diagonal() const { return storage_.diagonal(); }

  /// Sets a block and its mirror image, as far as they are stored.
  template <int kRow, int kColumn, class Block>
  void set_symmetric(const Block& value) {
    constexpr int kRows = Block::RowsAtCompileTime;
    constexpr int kColumns = Block::ColsAtCompileTime;
    if constexpr (kRow >= S || kColumn + kColumns <= S) {
      check_is_stored<kRow, kColumn, kRows, kColumns>();
      storage_.template block<kRows, kColumns>(kRow, kColumn) = value;
    }
    if constexpr (kColumn >= S || kRow + kRows <= S) {
      check_is_stored<kColumn, kRow, kColumns, kRows>();
      storage_.template block<kColumns, kRows>(kColumn, kRow) = value.transpose();
    }
  }
  /// Makes seen states independent of all others, with equal variances.
  template <int kFirst, int kCount>
  void set_independent(double variance) {
    seen_rows<kFirst, kCount>().setZero();
    columns<kFirst, kCount>().setZero();
    storage_.diagonal().template segment<kCount>(kFirst).setConstant(variance);
  }

  /// P - a b^T, for a b^T that is symmetric.
  void subtract_outer(const Eigen::Matrix<double, N, 1>& a, const Eigen::Matrix<double, N, 1>& b) {
    seen_columns() -= a * b.template head<S>().transpose();
    hidden() -= a.template tail<kHidden>() * b.template tail<kHidden>().transpose();
  }

  /// Both halves.
  [[nodiscard]] Full full() const { return storage_.template selfadjointView<Eigen::Lower>(); }

 private:
  template <int kRow, int kColumn, int kRows, int kColumns>
  static constexpr void check_is_stored() {
    static_assert(kRow >= 0 && kColumn >= 0 && kRow + kRows <= N && kColumn + kColumns <= N);
    static_assert(kRow >= S || kColumn + kColumns <= S,
                  "seen rows are stored with seen columns only");
  }

  Full storage_;
};

}  // namespace crepes
