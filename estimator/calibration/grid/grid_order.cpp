#include "estimator/calibration/grid/grid_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "estimator/core/so3.hpp"

namespace crepes {
namespace {

constexpr double kTolerance = 0.3;       // of the distance to the next LED
constexpr double kSeedTolerance = 0.35;  // the same, where the perspective is not known yet
constexpr int kLeastAround = 6;          // of the eight around a first LED
constexpr std::size_t kNearest = 8;
constexpr double kLeastCosine = 0.25;  // to the plane's center: lights further away are not in it
constexpr double kLeastShare = 0.5;    // of the grid's LEDs
constexpr int kNone = -1;

struct Cell {
  int row = 0;
  int column = 0;

  Cell operator+(const Cell& other) const { return {row + other.row, column + other.column}; }
  Cell operator*(int factor) const { return {row * factor, column * factor}; }
};

constexpr std::array<Cell, 8> kAround{
    {{0, 1}, {1, 0}, {0, -1}, {-1, 0}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};

/// The lights seen from the center of the sphere in the plane that touches it at `axis`, where a
/// flat grid is a perspective picture of itself. Those at infinity are far away.
std::vector<Eigen::Vector2d> plane_at(const Eigen::Vector3d& axis,
                                      std::span<const Eigen::Vector3d> directions) {
  constexpr double kFarAway = 1e6;
  const Eigen::Quaterniond q = shortest_rotation(axis, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector2d> points;
  points.reserve(directions.size());
  for (const Eigen::Vector3d& direction : directions) {
    const Eigen::Vector3d u = q * direction;
    points.emplace_back(u.z() > kLeastCosine ? Eigen::Vector2d(u.head<2>() / u.z())
                                             : Eigen::Vector2d::Constant(kFarAway));
  }
  return points;
}

/// A grid that grows from one light over its neighbors.
class Growth {
 public:
  Growth(std::span<const Eigen::Vector2d> points, const GridShape& shape)
      : points_(points),
        reach_(std::max(shape.rows, shape.columns)),
        side_(2 * reach_ + 1),
        cells_(static_cast<std::size_t>(side_) * static_cast<std::size_t>(side_), kNone),
        is_taken_(points.size(), false) {}

  /// Whether the lights around `first` continue its steps to two of its neighbors.
  [[nodiscard]] bool start(int first, int along_row, int along_column) {
    const Eigen::Vector2d a = at(along_row) - at(first);
    const Eigen::Vector2d b = at(along_column) - at(first);
    set({0, 0}, first);
    set({0, 1}, along_row);
    set({1, 0}, along_column);
    int around = 2;
    for (std::size_t k = 2; k < kAround.size(); ++k) {
      const auto& [row, column] = kAround.at(k);
      const Eigen::Vector2d expected = at(first) + row * b + column * a;
      around += take(kAround.at(k), expected, kSeedTolerance * std::min(a.norm(), b.norm()));
    }
    return around >= kLeastAround;
  }

  /// Cell by cell, the one that most neighbors foretell first.
  void grow() {
    std::vector<bool> is_tried(cells_.size(), false);
    for (;;) {
      std::optional<Forecast> best;
      for (int row = -reach_; row <= reach_; ++row) {
        for (int column = -reach_; column <= reach_; ++column) {
          const Cell cell{row, column};
          if (light(cell) != kNone || is_tried[index(cell)]) continue;
          const auto forecast = forecast_of(cell);
          if (forecast && (!best || forecast->weight > best->weight)) best = forecast;
        }
      }
      if (!best) return;
      is_tried[index(best->cell)] = true;
      if (take(best->cell, best->point, kTolerance * best->spacing))
        for (const Cell& step : kAround)
          for (int k = 1; k <= 3; ++k)
            if (contains(best->cell + step * k)) is_tried[index(best->cell + step * k)] = false;
    }
  }

  /// An LED and the number of its light.
  struct Place {
    int row = 0;
    int column = 0;
    int light = kNone;
  };
  /// Where the grid fits best. Lights outside speak against it: from steps along a diagonal grows a
  /// slanting grid.
  struct Window {
    int score = 0;  ///< lights inside less those outside
    std::vector<Place> places;
  };
  [[nodiscard]] Window window(const GridShape& shape) const {
    const int all =
        static_cast<int>(std::ranges::count_if(cells_, [](int i) { return i != kNone; }));
    Window best;
    for (int top = -reach_; top + shape.rows - 1 <= reach_; ++top) {
      for (int left = -reach_; left + shape.columns - 1 <= reach_; ++left) {
        Window next{.score = 0, .places = places(top, left, shape)};
        next.score = 2 * static_cast<int>(next.places.size()) - all;
        if (next.score > best.score) best = std::move(next);
      }
    }
    return best;
  }

 private:
  struct Forecast {
    Cell cell;
    Eigen::Vector2d point = Eigen::Vector2d::Zero();
    double weight = 0.0;
    double spacing = 0.0;
  };

  [[nodiscard]] bool contains(const Cell& cell) const {
    return std::abs(cell.row) <= reach_ && std::abs(cell.column) <= reach_;
  }
  [[nodiscard]] std::size_t index(const Cell& cell) const {
    return static_cast<std::size_t>((cell.row + reach_) * side_ + cell.column + reach_);
  }
  [[nodiscard]] int light(const Cell& cell) const {
    return contains(cell) ? cells_[index(cell)] : kNone;
  }
  [[nodiscard]] const Eigen::Vector2d& at(int light) const {
    return points_[static_cast<std::size_t>(light)];
  }
  void set(const Cell& cell, int light) {
    cells_[index(cell)] = light;
    is_taken_[static_cast<std::size_t>(light)] = true;
  }

  bool take(const Cell& cell, const Eigen::Vector2d& expected, double tolerance) {
    int nearest = kNone;
    double least = tolerance;
    for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
      const double off = (at(i) - expected).norm();
      if (off >= least || is_taken_[static_cast<std::size_t>(i)]) continue;
      least = off;
      nearest = i;
    }
    if (nearest == kNone) return false;
    set(cell, nearest);
    return true;
  }

  /// From rows and diagonals that continue, and parallelograms that close.
  [[nodiscard]] std::optional<Forecast> forecast_of(const Cell& cell) const {
    Forecast forecast{.cell = cell};
    const auto add = [&](const Eigen::Vector2d& point, double weight, double spacing) {
      forecast.point += weight * point;
      forecast.weight += weight;
      forecast.spacing = forecast.spacing == 0.0 ? spacing : std::min(forecast.spacing, spacing);
    };
    for (const Cell& step : kAround) {
      const int one = light(cell + step);
      const int two = light(cell + step * 2);
      const int three = light(cell + step * 3);
      if (one == kNone || two == kNone) continue;
      const double spacing = (at(one) - at(two)).norm();
      if (three != kNone)
        add(3.0 * at(one) - 3.0 * at(two) + at(three), 1.0, spacing);
      else
        add(2.0 * at(one) - at(two), 0.5, spacing);
    }
    for (std::size_t k = 4; k < kAround.size(); ++k) {
      const auto& [row, column] = kAround.at(k);
      const int corner = light(cell + kAround.at(k));
      const int beside = light(cell + Cell{0, column});
      const int above = light(cell + Cell{row, 0});
      if (corner == kNone || beside == kNone || above == kNone) continue;
      add(at(beside) + at(above) - at(corner), 1.0,
          std::min((at(beside) - at(corner)).norm(), (at(above) - at(corner)).norm()));
    }
    if (forecast.weight == 0.0) return std::nullopt;
    forecast.point /= forecast.weight;
    return forecast;
  }

  [[nodiscard]] std::vector<Place> places(int top, int left, const GridShape& shape) const {
    std::vector<Place> found;
    for (int row = 0; row < shape.rows; ++row)
      for (int column = 0; column < shape.columns; ++column)
        if (const int i = light({top + row, left + column}); i != kNone)
          found.push_back({row, column, i});
    return found;
  }

  std::span<const Eigen::Vector2d> points_;
  int reach_;
  int side_;
  std::vector<int> cells_;  ///< of each cell its light
  std::vector<bool> is_taken_;
};

std::vector<int> nearest_to(int first, std::span<const Eigen::Vector2d> points) {
  std::vector<int> order;
  for (int i = 0; i < static_cast<int>(points.size()); ++i)
    if (i != first) order.push_back(i);
  const std::size_t count = std::min(kNearest, order.size());
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(count), {},
                            [&](int i) { return points[static_cast<std::size_t>(i)].norm(); });
  order.resize(count);
  return order;
}

/// Whether two steps can be the sides of one square in perspective.
bool are_sides(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  constexpr double kMostRatio = 4.0;
  constexpr double kLeastSine = 0.35;
  const double sine = (a.x() * b.y() - a.y() * b.x()) / (a.norm() * b.norm());
  return sine > kLeastSine && a.norm() < kMostRatio * b.norm() && b.norm() < kMostRatio * a.norm();
}

/// The best window of those that grow from `first` over any two of its neighbors.
Growth::Window best_window_from(int first, std::span<const Eigen::Vector3d> directions,
                                const GridShape& shape) {
  const auto points = plane_at(directions[static_cast<std::size_t>(first)], directions);
  const std::vector<int> near = nearest_to(first, points);
  Growth::Window best;
  for (const int along_row : near) {
    for (const int along_column : near) {
      if (!are_sides(points[static_cast<std::size_t>(along_row)],
                     points[static_cast<std::size_t>(along_column)]))
        continue;
      Growth growth(points, shape);
      if (!growth.start(first, along_row, along_column)) continue;
      growth.grow();
      if (auto window = growth.window(shape); window.score > best.score) best = std::move(window);
      if (best.score == shape.leds()) return best;
    }
  }
  return best;
}

/// Grows from one light after the other until a whole grid is found. Lights of a window that may be
/// the grid would grow into the same one again, and are no longer started from.
Growth::Window best_window(std::span<const Eigen::Vector3d> directions, const GridShape& shape) {
  Growth::Window best;
  std::vector<bool> is_done(directions.size(), false);
  for (std::size_t first = 0; first < directions.size() && best.score < shape.leds(); ++first) {
    if (is_done[first]) continue;
    auto window = best_window_from(static_cast<int>(first), directions, shape);
    if (window.score >= kLeastShare * shape.leds())
      for (const Growth::Place& place : window.places)
        is_done[static_cast<std::size_t>(place.light)] = true;
    if (window.score > best.score) best = std::move(window);
  }
  return best;
}

}  // namespace

std::vector<GridLed> find_grid(std::span<const Eigen::Vector2d> lights, const GridLens& lens,
                               const GridShape& shape) {
  std::vector<Eigen::Vector3d> directions;
  std::vector<Eigen::Vector2d> seen;
  for (const Eigen::Vector2d& uv : lights) {
    const auto direction = lens.direction(uv);
    if (!direction) continue;
    directions.push_back(*direction);
    seen.push_back(uv);
  }
  std::vector<GridLed> leds;
  for (const auto& [row, column, light] : best_window(directions, shape).places)
    leds.push_back({row, column, seen[static_cast<std::size_t>(light)]});
  if (static_cast<double>(leds.size()) < kLeastShare * shape.leds()) return {};
  return leds;
}

}  // namespace crepes
