#include "estimator/vision/assignment.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace crepes::assignment_test {
namespace {

double total(const std::vector<std::optional<std::size_t>>& column_of,
             const std::vector<PairBenefit>& pairs) {
  double sum = 0.0;
  for (const PairBenefit& pair : pairs)
    if (column_of[pair.row] == pair.column) sum += pair.benefit;
  return sum;
}

/// The greatest sum, by trying everything.
double best_total(std::size_t row, std::size_t rows, std::vector<bool>& is_taken,
                  const std::vector<PairBenefit>& pairs) {
  if (row == rows) return 0.0;
  double best = best_total(row + 1, rows, is_taken, pairs);
  for (const PairBenefit& pair : pairs) {
    if (pair.row != row || is_taken[pair.column]) continue;
    is_taken[pair.column] = true;
    best = std::max(best, pair.benefit + best_total(row + 1, rows, is_taken, pairs));
    is_taken[pair.column] = false;
  }
  return best;
}

TEST(Assignment, GivesTheGreatestSumAndNoColumnTwice) {
  std::mt19937 random(4);
  Assignment assignment;
  for (int trial = 0; trial < 3000; ++trial) {
    const std::size_t rows = random() % 7U;
    const std::size_t columns = random() % 7U;
    std::vector<PairBenefit> pairs;
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t c = 0; c < columns; ++c)
        if (random() % 3U > 0)
          pairs.push_back({r, c, std::uniform_real_distribution<double>(-2.0, 10.0)(random)});

    const auto& column_of = assignment.solve(rows, columns, pairs);

    std::vector<bool> is_taken(columns, false);
    for (const auto& column : column_of) {
      if (!column) continue;
      ASSERT_FALSE(is_taken[*column]);
      is_taken[*column] = true;
    }
    std::vector<bool> none(columns, false);
    ASSERT_NEAR(total(column_of, pairs), best_total(0, rows, none, pairs), 1e-9);
  }
}

TEST(Assignment, PrefersTwoGoodPairsToTheBestOneAlone) {
  Assignment assignment;

  const auto column_of = assignment.solve(2, 2, {{0, 0, 10.0}, {0, 1, 9.0}, {1, 0, 9.0}});

  EXPECT_EQ(column_of[0], 1U);
  EXPECT_EQ(column_of[1], 0U);
}

TEST(Assignment, FindsTheSameSumFromBothSidesWhenEverythingCouldBeEverything) {
  constexpr std::size_t kMany = 200;
  std::mt19937 random(2);
  std::vector<PairBenefit> pairs;
  std::vector<PairBenefit> turned(kMany * kMany);
  for (std::size_t r = 0; r < kMany; ++r)
    for (std::size_t c = 0; c < kMany; ++c) {
      pairs.push_back({r, c, std::uniform_real_distribution<double>(0.0, 10.0)(random)});
      turned[c * kMany + r] = {c, r, pairs.back().benefit};
    }
  Assignment assignment;

  const double sum = total(assignment.solve(kMany, kMany, pairs), pairs);
  const double turned_sum = total(assignment.solve(kMany, kMany, turned), turned);

  EXPECT_NEAR(sum, turned_sum, 1e-6);
  EXPECT_GT(sum, 9.9 * kMany);
}

}  // namespace
}  // namespace crepes::assignment_test
