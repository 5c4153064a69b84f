#include "estimator/calibration/grid/grid_order.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/support/simulated_grid.hpp"

namespace crepes::grid_order_test {
namespace {

using simulated::five_by_seven;
using simulated::SeenGrid;
using simulated::SeenLed;

GridLens rough_lens() {
  return generic_grid_lens(LensKind::kDoubleSphere, {simulated::kGridWidth, simulated::kGridHeight},
                           radians(180.0), 1.0);
}

std::vector<Eigen::Vector2d> lights_of(const SeenGrid& grid, std::uint64_t seed) {
  std::vector<Eigen::Vector2d> lights;
  for (const SeenLed& led : grid.leds) lights.push_back(led.uv);
  std::mt19937_64 dice(seed);
  std::ranges::shuffle(lights, dice);
  return lights;
}

/// Whether neighbors in the found order are neighbors on the grid, all turned by the same.
bool is_in_order(const std::vector<GridLed>& found, const SeenGrid& truth) {
  const auto place = [&](const GridLed& led) {
    const auto same = std::ranges::find_if(
        truth.leds, [&](const SeenLed& seen) { return (seen.uv - led.uv).norm() < 1e-9; });
    return same == truth.leds.end() ? Eigen::Vector2i(-99, -99)
                                    : Eigen::Vector2i(same->row, same->column);
  };
  for (const GridLed& a : found) {
    for (const GridLed& b : found) {
      const Eigen::Vector2i step = place(a) - place(b);
      const Eigen::Vector2i expected(a.row - b.row, a.column - b.column);
      if (step != expected && step != Eigen::Vector2i(-expected)) return false;
    }
  }
  return !found.empty();
}

// The lens is only guessed, so that a corner at the rim may be missed.
TEST(GridOrder, FindsAGridAcrossTheFieldOfViewOfAFisheye) {
  int whole = 0;
  int all = 0;
  for (const SeenGrid& grid : simulated::seen_grids(1, 60, {})) {
    if (grid.leds.size() < 35) continue;
    ++all;
    const auto found = find_grid(lights_of(grid, 1), rough_lens(), five_by_seven());
    EXPECT_GE(found.size(), 30U);
    EXPECT_TRUE(is_in_order(found, grid));
    whole += found.size() == 35 ? 1 : 0;
  }

  ASSERT_GT(all, 30);
  EXPECT_GE(10 * whole, 9 * all);
}

TEST(GridOrder, FindsAGridOfWhichCornersAreMissingAmongOtherLights) {
  int right = 0;
  int all = 0;
  for (SeenGrid grid : simulated::seen_grids(2, 60, {})) {
    if (grid.leds.size() < 35) continue;
    ++all;
    std::erase_if(grid.leds, [](const SeenLed& led) {
      return (led.row == 0 && led.column == 0) || (led.row == 4 && led.column > 4) ||
             (led.row == 2 && led.column == 3);
    });
    auto lights = lights_of(grid, 2);
    std::mt19937_64 dice(3);
    for (int k = 0; k < 20; ++k)
      lights.emplace_back(static_cast<double>(dice() % simulated::kGridWidth),
                          static_cast<double>(dice() % simulated::kGridHeight));
    const auto found = find_grid(lights, rough_lens(), five_by_seven());
    std::size_t of_grid = 0;
    std::vector<GridLed> own;
    for (const GridLed& led : found)
      if (std::ranges::any_of(grid.leds, [&](const SeenLed& s) { return s.uv == led.uv; })) {
        ++of_grid;
        own.push_back(led);
      }
    right += of_grid >= 28 && is_in_order(own, grid) ? 1 : 0;
  }

  ASSERT_GT(all, 30);
  EXPECT_GE(right, all - 5);
}

TEST(GridOrder, FindsNoGridInScatteredLights) {
  std::mt19937_64 dice(5);
  std::vector<Eigen::Vector2d> lights;
  for (int k = 0; k < 60; ++k)
    lights.emplace_back(static_cast<double>(dice() % simulated::kGridWidth),
                        static_cast<double>(dice() % simulated::kGridHeight));

  EXPECT_TRUE(find_grid(lights, rough_lens(), five_by_seven()).empty());
}

TEST(GridOrder, TakesNoGridOfAnotherSizeForHalfOfOne) {
  const GridShape small{.rows = 3, .columns = 3, .pitch_m = 0.05};
  const auto grids = simulated::seen_grids(4, 5, {}, simulated::grid_camera(), small);

  for (const SeenGrid& grid : grids)
    EXPECT_TRUE(find_grid(lights_of(grid, 4), rough_lens(), five_by_seven()).empty());
}

}  // namespace
}  // namespace crepes::grid_order_test
