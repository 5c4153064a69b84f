#include "estimator/vision/assignment.hpp"

namespace crepes {

const std::vector<std::optional<std::size_t>>& Assignment::solve(
    std::size_t rows, std::size_t columns, const std::vector<PairBenefit>& pairs) {
  first_pair_.assign(rows + 1, 0);
  for (const PairBenefit& pair : pairs) ++first_pair_[pair.row + 1];
  for (std::size_t r = 0; r < rows; ++r) first_pair_[r + 1] += first_pair_[r];
  row_price_.assign(rows, 0.0);
  columns_.assign(columns, {});
  column_of_.assign(rows, std::nullopt);
  for (std::size_t r = 0; r < rows; ++r) place(r, pairs);
  return column_of_;
}

/// The reduced cost of a pair, -benefit - row price - column price, is never negative between rows
/// and columns that were placed before, so Dijkstra finds the cheapest way to make room.
void Assignment::reach_from(std::size_t row, double base, const std::vector<PairBenefit>& pairs) {
  for (std::size_t i = first_pair_[row]; i < first_pair_[row + 1]; ++i) {
    Column& column = columns_[pairs[i].column];
    if (column.state == Column::kDone) continue;
    const double distance = base - pairs[i].benefit - row_price_[row] - column.price;
    if (column.state == Column::kReached && column.distance <= distance) continue;
    if (column.state == Column::kFar) reached_.push_back(pairs[i].column);
    column.state = Column::kReached;
    column.distance = distance;
    column.reached_by = row;
  }
}

std::optional<std::size_t> Assignment::nearest() const {
  std::optional<std::size_t> best;
  for (const std::size_t c : reached_) {
    const bool is_open = columns_[c].state == Column::kReached;
    if (is_open && (!best || columns_[c].distance < columns_[*best].distance)) best = c;
  }
  return best;
}

void Assignment::place(std::size_t row, const std::vector<PairBenefit>& pairs) {
  reached_.clear();
  std::size_t loser = row;             // who would stay alone at least cost, and
  double alone = -row_price_[row];     // that cost
  std::optional<std::size_t> vacancy;  // the column that is free at less
  reach_from(row, 0.0, pairs);
  for (auto next = nearest(); next && columns_[*next].distance < alone; next = nearest()) {
    Column& column = columns_[*next];
    if (!column.row) {
      vacancy = next;
      break;
    }
    column.state = Column::kDone;
    if (column.distance - row_price_[*column.row] < alone) {
      alone = column.distance - row_price_[*column.row];
      loser = *column.row;
    }
    reach_from(*column.row, column.distance, pairs);
  }

  const double total = vacancy ? columns_[*vacancy].distance : alone;
  row_price_[row] += total;
  for (const std::size_t c : reached_) {
    Column& column = columns_[c];
    if (column.state == Column::kDone) {
      row_price_[*column.row] += total - column.distance;
      column.price -= total - column.distance;
    }
    column.state = Column::kFar;
  }
  // Everyone on the way moves on by one.
  std::optional<std::size_t> free = vacancy ? vacancy : column_of_[loser];
  if (!vacancy) column_of_[loser].reset();
  while (free) {
    const std::size_t mover = columns_[*free].reached_by;
    const std::optional<std::size_t> left = column_of_[mover];
    columns_[*free].row = mover;
    column_of_[mover] = free;
    free = left;
  }
}

}  // namespace crepes
