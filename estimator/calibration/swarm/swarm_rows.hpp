/// Rows of a Jacobian that concern a few knots and constants of a swarm.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "estimator/calibration/batch/arrow_system.hpp"

namespace crepes {

/// Columns of a row of the Jacobian, and what they are: of a knot of a robot, or constants.
struct Columns {
  static constexpr std::size_t kConstants = std::numeric_limits<std::size_t>::max();
  int begin = 0;
  int size = 0;
  std::size_t knot = kConstants;
  int where = 0;  ///< in the state of the knot, or among the constants
};

/// Adds J^T J and -J^T r of rows (J | r) to the normal equations.
void add_rows(const Eigen::Ref<const Eigen::MatrixXd>& rows, std::span<const Columns> all,
              TeamArrowSystem& system);

/// Rows of readings that concern the same intervals, until they are added at once.
class RowBuffer {
 public:
  RowBuffer(int columns, TeamArrowSystem& system)
      : rows_(Eigen::MatrixXd::Zero(kMost, columns + 1)), system_(&system) {}

  template <int Rows>
  Eigen::Ref<Eigen::MatrixXd> next(const std::vector<Columns>& columns) {
    const bool is_same =
        used_ > 0 && columns[0].knot == columns_[0].knot && columns[2].knot == columns_[2].knot;
    if (!is_same || used_ + Rows > kMost) flush();
    columns_ = columns;
    used_ += Rows;
    return rows_.middleRows(used_ - Rows, Rows);
  }
  void flush() {
    if (used_ > 0) add_rows(rows_.topRows(used_), columns_, *system_);
    used_ = 0;
  }

 private:
  static constexpr Eigen::Index kMost = 64;
  Eigen::MatrixXd rows_;
  TeamArrowSystem* system_;
  std::vector<Columns> columns_;
  Eigen::Index used_ = 0;
};

}  // namespace crepes
