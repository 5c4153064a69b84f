#include "estimator/vision/ring_model.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
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

/// Least squares over  w (1 + g q) = x p,  p = (1, q), where w is the observed position and x are
/// the coefficients of one coordinate. The problem is linear in x and g, and x is eliminated. The
/// prior is  g ~ N(0, (radius / f)^2) : without it, a few LEDs in a short arc fit any perspective.
std::optional<RingView> fit_perspective(const RingView& from_afar,
                                        std::span<const Eigen::Vector2d> seen,
                                        std::span<const Eigen::Vector2d> places) {
  const double radius = from_afar.radius();
  if (!(radius > 0.0)) return std::nullopt;
  using Matrix32 = Eigen::Matrix<double, 3, 2>;
  const double ridge = std::pow(kLightSigma * kFocalLength / (radius * radius), 2);
  Eigen::Matrix3d S = Eigen::Matrix3d::Zero();
  Matrix32 b = Matrix32::Zero();  // a column for each coordinate
  std::array<Matrix32, 2> M{Matrix32::Zero(), Matrix32::Zero()};
  Eigen::Matrix2d G = ridge * Eigen::Matrix2d::Identity();
  Eigen::Vector2d h = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Eigen::Vector2d w = (seen[i] - from_afar.center) / radius;
    const Eigen::Vector2d& q = places[i];
    const Eigen::Vector3d p(1.0, q.x(), q.y());
    const Matrix32 pq = p * q.transpose();
    S += p * p.transpose();
    b += p * w.transpose();
    M[0] += w.x() * pq;
    M[1] += w.y() * pq;
    G += w.squaredNorm() * q * q.transpose();
    h -= w.squaredNorm() * q;
  }
  const Eigen::Matrix3d S_inverse = S.inverse();
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::Matrix<double, 2, 3> MS = M[k].transpose() * S_inverse;
    G -= MS * M[k];
    h += MS * b.col(static_cast<Eigen::Index>(k));
  }
  RingView view;
  view.slant = G.inverse() * h;
  const Eigen::Vector3d x_u = S_inverse * (b.col(0) + M[0] * view.slant);
  const Eigen::Vector3d x_v = S_inverse * (b.col(1) + M[1] * view.slant);
  if (!x_u.allFinite() || !x_v.allFinite() || view.slant.norm() > kMaxSlant) return std::nullopt;
  const Eigen::Vector2d c(x_u(0), x_v(0));
  // (c + A q) / (1 + g q)  =  c + (A - c g) q / (1 + g q)
  view.axes << x_u(1), x_u(2), x_v(1), x_v(2);
  view.axes = radius * (view.axes - c * view.slant.transpose());
  view.center = from_afar.center + radius * c;
  return view;
}

}  // namespace crepes
