#include "estimator/vision/square_outline.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace crepes {
namespace {

constexpr int kStarts = 4;         // directions of edges that are tried, within a quarter turn
constexpr int kOutlineRounds = 6;  // of assigning points to edges
constexpr int kEdgeParts = 12;     // of an edge
constexpr double kInside = 0.7;  // half of a square's edge against the radius of its nearest circle

using Edges = SquareOutline::Edges;

/// The pair of edges nearest to `uv`, 0 or 1.
std::size_t nearest_pair(const SquareOutline& outline, const Eigen::Vector2d& uv) {
  const auto off = [&](const Edges& edges) {
    return std::abs(std::abs(edges.from_middle(uv)) - edges.half);
  };
  return off(outline.pairs[0]) <= off(outline.pairs[1]) ? 0 : 1;
}

/// The points of one edge.
struct EdgePoints {
  double count = 0.0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();

  void add(const Eigen::Vector2d& uv) {
    count += 1.0;
    sum += uv;
    squares += uv * uv.transpose();
  }
  [[nodiscard]] Eigen::Vector2d mean() const { return sum / count; }
  [[nodiscard]] Eigen::Matrix2d scatter() const { return squares - sum * sum.transpose() / count; }
};

/// Both lines have the direction in which their points scatter most about their own means.
std::optional<Edges> parallel_lines(const EdgePoints& above, const EdgePoints& below) {
  if (above.count < 2.0 || below.count < 2.0) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(above.scatter() + below.scatter());
  Edges edges{.normal = axes.eigenvectors().col(0)};
  const double a = edges.normal.dot(above.mean());
  const double b = edges.normal.dot(below.mean());
  if (a < b) edges.normal = -edges.normal;
  edges.middle = (a < b ? -0.5 : 0.5) * (a + b);
  edges.half = 0.5 * std::abs(a - b);
  return edges;
}

std::optional<SquareOutline> improved(const SquareOutline& outline,
                                      std::span<const Eigen::Vector2d> points) {
  std::array<std::array<EdgePoints, 2>, 2> edges_of{};
  for (const Eigen::Vector2d& uv : points) {
    const std::size_t k = nearest_pair(outline, uv);
    edges_of.at(k).at(outline.pairs.at(k).from_middle(uv) >= 0.0 ? 0 : 1).add(uv);
  }
  SquareOutline next;
  for (std::size_t k = 0; k < 2; ++k) {
    const auto edges = parallel_lines(edges_of.at(k)[0], edges_of.at(k)[1]);
    if (!edges) return std::nullopt;
    next.pairs.at(k) = *edges;
  }
  return next;
}

/// A square in the plane of the view, turned by `angle`.
SquareOutline square_in(const RingView& view, double angle) {
  const Eigen::Matrix2d to_place = view.axes.inverse();
  SquareOutline outline;
  for (std::size_t k = 0; k < 2; ++k) {
    const double a = angle + 0.5 * std::numbers::pi * static_cast<double>(k);
    const Eigen::Vector2d row = to_place.transpose() * Eigen::Vector2d(std::cos(a), std::sin(a));
    outline.pairs.at(k) = {.normal = row.normalized(),
                           .middle = row.normalized().dot(view.center),
                           .half = kInside / row.norm()};
  }
  return outline;
}

double mean_square(const SquareOutline& outline, std::span<const Eigen::Vector2d> points) {
  double sum = 0.0;
  for (const Eigen::Vector2d& uv : points) sum += std::pow(outline.distance_from(uv), 2);
  return sum / static_cast<double>(points.size());
}

}  // namespace

double SquareOutline::distance_from(const Eigen::Vector2d& uv) const {
  const double a = std::abs(pairs[0].from_middle(uv)) - pairs[0].half;
  const double b = std::abs(pairs[1].from_middle(uv)) - pairs[1].half;
  if (a <= 0.0 && b <= 0.0) return std::min(-a, -b);
  return std::max(a, b);
}

RingView SquareOutline::view() const {
  Eigen::Matrix2d rows;
  rows << pairs[0].normal.transpose(), pairs[1].normal.transpose();
  const Eigen::Matrix2d inverse = rows.inverse();
  RingView view;
  view.center = inverse * Eigen::Vector2d(pairs[0].middle, pairs[1].middle);
  view.axes = inverse * Eigen::Vector2d(pairs[0].half, pairs[1].half).asDiagonal();
  return view;
}

std::optional<SquareOutline> fit_square(std::span<const Eigen::Vector2d> points,
                                        const RingView& first) {
  std::optional<SquareOutline> outline;
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kStarts; ++k) {
    const auto start = improved(square_in(first, 0.5 * std::numbers::pi * k / kStarts), points);
    const double square = start ? mean_square(*start, points) : least;
    if (square >= least) continue;
    outline = start;
    least = square;
  }
  for (int round = 1; round < kOutlineRounds && outline; ++round) {
    const auto next = improved(*outline, points);
    const bool is_same = next && *next == *outline;  // as all later ones would be
    outline = next;
    if (is_same) break;
  }
  return outline;
}

double share_covered(const SquareOutline& outline, std::span<const Eigen::Vector2d> points) {
  std::array<bool, 4UL * kEdgeParts> is_lit{};
  for (const Eigen::Vector2d& uv : points) {
    const std::size_t k = nearest_pair(outline, uv);
    const Edges& along = outline.pairs.at(1 - k);
    const double place = 0.5 + 0.5 * along.from_middle(uv) / along.half;  // 0 to 1
    const auto part = static_cast<std::size_t>(
        std::clamp(std::floor(place * kEdgeParts), 0.0, static_cast<double>(kEdgeParts - 1)));
    const std::size_t edge = 2 * k + (outline.pairs.at(k).from_middle(uv) >= 0.0 ? 1 : 0);
    is_lit.at(edge * kEdgeParts + part) = true;
  }
  const Eigen::Matrix2d axes = outline.view().axes;
  double lit = 0.0;
  for (std::size_t part = 0; part < is_lit.size(); ++part)
    if (is_lit.at(part)) lit += axes.col(part < 2UL * kEdgeParts ? 1 : 0).norm();
  return lit / (2.0 * kEdgeParts * (axes.col(0).norm() + axes.col(1).norm()));
}

}  // namespace crepes
