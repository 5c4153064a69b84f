/// The best one-to-one pairing of rows with columns.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace crepes {

/// A possible pair, and how much better it is than leaving both alone.
struct PairBenefit {
  std::size_t row = 0;
  std::size_t column = 0;
  double benefit = 0.0;
};

/// Pairs rows with columns so that the sum of benefits is the greatest possible; rows and columns
/// may stay alone. Shortest augmenting paths over the pairs that are given (Jonker, Volgenant
/// 1987): cost grows with the size of connected clusters, not of the whole. Equal sums are decided
/// by the order of rows and pairs. Keeps its memory between calls.
class Assignment {
 public:
  /// The column of each row; `pairs` are ordered by row and are finite.
  [[nodiscard]] const std::vector<std::optional<std::size_t>>& solve(
      std::size_t rows, std::size_t columns, const std::vector<PairBenefit>& pairs);

 private:
  struct Column {
    double price = 0.0;
    std::optional<std::size_t> row;
    double distance = 0.0;       ///< from the row that is being placed
    std::size_t reached_by = 0;  ///< row
    enum { kFar, kReached, kDone } state = kFar;
  };

  void place(std::size_t row, const std::vector<PairBenefit>& pairs);
  void reach_from(std::size_t row, double base, const std::vector<PairBenefit>& pairs);
  [[nodiscard]] std::optional<std::size_t> nearest() const;

  std::vector<std::size_t> first_pair_;  ///< of each row, and the end
  std::vector<double> row_price_;
  std::vector<Column> columns_;
  std::vector<std::size_t> reached_;
  std::vector<std::optional<std::size_t>> column_of_;
};

}  // namespace crepes
