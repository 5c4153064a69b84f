#include "estimator/vision/ring_model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace crepes {
namespace {

constexpr double kLightSigma = 0.2;     // px, of the center of a light
constexpr double kFocalLength = 400.0;  // px, of a typical lens: slant is about radius over it
constexpr double kLeastExtent = 1e-3;   // of the places' spread: less is a line
constexpr double kMaxSlant = 0.4;       // a board almost at the lens

}  // namespace

RingShape RingShape::round(int leds) {
  RingShape shape;
  for (int led = 0; led < leds; ++led) {
    const double angle = 2.0 * std::numbers::pi * led / leds;
    shape.places.emplace_back(std::cos(angle), std::sin(angle));
  }
  return shape;
}

RingShape RingShape::square(int leds) {
  RingShape shape;
  const int of_edge = leds / 4;
  for (int led = 0; led < leds; ++led) {
    const double along = 2.0 * (led % of_edge) / of_edge - 1.0;
    Eigen::Vector2d place(1.0, along);
    for (int turn = 0; turn < led / of_edge; ++turn) place = {-place.y(), place.x()};
    shape.places.push_back(place);
  }
  return shape;
}

Eigen::Vector2d RingView::place_near(const Eigen::Vector2d& uv) const {
  return axes.inverse() * (uv - center);
}

double RingView::radius() const {
  const double middle = 0.5 * axes.squaredNorm();
  const double det = axes.determinant();
  return std::sqrt(middle + std::sqrt(std::max(0.0, middle * middle - det * det)));
}

double RingView::roundness() const {
  const double longer = radius();
  return longer > 0.0 ? std::abs(axes.determinant()) / (longer * longer) : 0.0;
}

double RingView::rms(std::span<const Eigen::Vector2d> seen,
                     std::span<const Eigen::Vector2d> places) const {
  double squares = 0.0;
  for (std::size_t i = 0; i < seen.size(); ++i) squares += (seen[i] - at(places[i])).squaredNorm();
  return std::sqrt(squares / static_cast<double>(seen.size()));
}

std::optional<RingView> fit_from_afar(std::span<const Eigen::Vector2d> seen,
                                      std::span<const Eigen::Vector2d> places) {
  Eigen::Vector2d middle_seen = Eigen::Vector2d::Zero();
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    middle_seen += seen[i];
    middle += places[i];
  }
  const auto count = static_cast<double>(seen.size());
  middle_seen /= count;
  middle /= count;
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Matrix2d mixed = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector2d q = places[i] - middle;
    spread += q * q.transpose();
    mixed += (seen[i] - middle_seen) * q.transpose();
  }
  if (spread.determinant() < kLeastExtent * count) return std::nullopt;
  RingView view;
  view.axes = mixed * spread.inverse();
  view.center = middle_seen - view.axes * middle;
  return view;
}

/// Least squares over  u (1 + g q) = c + A q,  which is linear in c, A and g, with
/// g ~ N(0, (radius / f)^2): without it, a few LEDs in a short arc would tell any perspective.
std::optional<RingView> fit_perspective(std::span<const Eigen::Vector2d> seen,
                                        std::span<const Eigen::Vector2d> places) {
  const auto from_afar = fit_from_afar(seen, places);
  if (!from_afar) return std::nullopt;
  const double radius = from_afar->radius();
  if (!(radius > 0.0)) return std::nullopt;
  using Matrix8 = Eigen::Matrix<double, 8, 8>;
  using Vector8 = Eigen::Matrix<double, 8, 1>;
  Matrix8 normal = Matrix8::Zero();
  Vector8 right = Vector8::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector2d w = (seen[i] - from_afar->center) / radius;
    const Eigen::Vector2d& q = places[i];
    Vector8 row_u;
    Vector8 row_v;
    row_u << 1.0, q.x(), q.y(), 0.0, 0.0, 0.0, -w.x() * q.x(), -w.x() * q.y();
    row_v << 0.0, 0.0, 0.0, 1.0, q.x(), q.y(), -w.y() * q.x(), -w.y() * q.y();
    normal.noalias() += row_u * row_u.transpose() + row_v * row_v.transpose();
    right += row_u * w.x() + row_v * w.y();
  }
  const double ridge = std::pow(kLightSigma / radius / (radius / kFocalLength), 2);
  normal(6, 6) += ridge;
  normal(7, 7) += ridge;
  const Vector8 x = normal.ldlt().solve(right);
  RingView view;
  view.slant = x.tail<2>();
  view.axes << x(1), x(2), x(4), x(5);
  const Eigen::Vector2d c(x(0), x(3));
  // (c + A q) / (1 + g q)  =  c + (A - c g) q / (1 + g q)
  view.axes = radius * (view.axes - c * view.slant.transpose());
  view.center = from_afar->center + radius * c;
  if (!x.allFinite() || view.slant.norm() > kMaxSlant) return std::nullopt;
  return view;
}

}  // namespace crepes
