#include "estimator/vision/arc_joiner.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/vision/square_outline.hpp"

namespace crepes {
namespace {

constexpr int kMaxGap = 10;            // px between LEDs of a ring of which others touch
constexpr int kMaxRingSide = 64;       // px; on a larger board no LEDs touch
constexpr std::int32_t kLeastLed = 8;  // px^2
constexpr std::size_t kMostPixels = 2000;
constexpr std::size_t kUsualArcs = 1024;
constexpr double kArcArea = 1.5;        // of an LED's: two that touch
constexpr double kLongArcArea = 4.0;    // the same where there is nothing but an arc and an LED
constexpr double kArcElongation = 1.4;  // of an arc, where there is nothing but arcs
constexpr double kArcMiddle = 0.9;  // of the radius: an arc's; that of a streak is on the ellipse
constexpr double kMinArcRoundness = 0.28;
constexpr double kOffEllipse = 1.0;        // px beside half an LED
constexpr double kLeastCovered = 0.6;      // of the ellipse's length
constexpr double kArcsCovered = 0.75;      // the same where there is nothing but arcs
constexpr double kLeastHole = 2.0;         // px
constexpr double kHole = 0.4;              // of the radius: the lens
constexpr std::size_t kLeastOfSquare = 4;  // blobs: two edges, and LEDs on both others
constexpr double kEdgeArea = 2.5;          // of an LED's: three that touch
constexpr double kEdgeElongation = 2.0;    // of them
constexpr int kParts = 48;                 // of the ellipse

/// Nearly the distance of `uv` from the ellipse [px].
double distance_from(const RingView& view, const Eigen::Matrix2d& to_place,
                     const Eigen::Vector2d& uv) {
  const Eigen::Vector2d q = to_place * (uv - view.center);
  const double rho = q.norm();
  return rho > 0.0 ? std::abs(rho - 1.0) * rho / (to_place.transpose() * q).norm() : 1e9;
}

int gap_between(const PixelBox& a, const PixelBox& b) {
  return std::max({a.u_min - b.u_max, b.u_min - a.u_max, a.v_min - b.v_max, b.v_min - a.v_max}) - 1;
}

/// An ellipse's length [px].
struct Length {
  double lit = 0.0;
  double whole = 0.0;
};

Length length_of(const RingView& view, const Eigen::Matrix2d& to_place,
                 std::span<const Eigen::Vector2d> pixels) {
  std::array<bool, kParts> is_part_lit{};
  for (const Eigen::Vector2d& uv : pixels) {
    const Eigen::Vector2d q = to_place * (uv - view.center);
    const double turn = std::atan2(q.y(), q.x()) / (2.0 * std::numbers::pi) + 0.5;
    is_part_lit.at(static_cast<std::size_t>(turn * kParts) % kParts) = true;
  }
  Length sum;
  for (std::size_t part = 0; part < kParts; ++part) {
    const double angle =
        2.0 * std::numbers::pi * ((static_cast<double>(part) + 0.5) / kParts - 0.5);
    const double length = 2.0 * std::numbers::pi / kParts *
                          (view.axes * Eigen::Vector2d(-std::sin(angle), std::cos(angle))).norm();
    sum.whole += length;
    if (is_part_lit.at(part)) sum.lit += length;
  }
  return sum;
}

}  // namespace

ArcJoiner::ArcJoiner() {
  pixels_.reserve(kMostPixels);
  is_taken_.reserve(kUsualArcs);
  rings_.reserve(kUsualArcs);
}

template <class IsBoard>
std::span<const JoinedArcs> ArcJoiner::join_where(std::span<const std::uint32_t> open,
                                                  std::size_t blobs, const IsBoard& is_board) {
  rings_.clear();
  is_taken_.assign(blobs, 0);
  for (const std::uint32_t first : open) {
    if (is_taken_[first] != 0 || !is_board(first)) continue;
    for (const std::uint32_t i : ring_.members()) is_taken_[i] = 1;
    rings_.push_back(ring_);
  }
  return rings_;
}

std::span<const JoinedArcs> ArcJoiner::join_squares(std::span<const Blob> blobs,
                                                    std::span<const std::uint32_t> open,
                                                    const BlobFinder& finder) {
  return join_where(open, blobs.size(), [&](std::uint32_t edge) {
    if (blobs[edge].area < kEdgeArea * kLeastLed || blobs[edge].elongation() < kEdgeElongation ||
        !gather(edge, blobs, open) || !has_led_)
      return false;
    if (is_square(blobs, finder)) return true;
    for (const std::uint32_t i : ring_.members()) is_taken_[i] = 1;  // from each, the same
    return false;
  });
}

std::span<const JoinedArcs> ArcJoiner::join(std::span<const Blob> blobs,
                                            std::span<const std::uint32_t> open,
                                            const BlobFinder& finder) {
  return join_where(open, blobs.size(), [&](std::uint32_t arc) {
    return gather(arc, blobs, open) && (is_ring(blobs, finder) || is_square(blobs, finder));
  });
}

/// Whether the blob, which may be an arc, has neighbors that may be its ring's.
bool ArcJoiner::gather(std::uint32_t arc, std::span<const Blob> blobs,
                       std::span<const std::uint32_t> open) {
  ring_.count = 0;
  if (blobs[arc].area < kArcArea * kLeastLed || blobs[arc].box.width() > kMaxRingSide ||
      blobs[arc].box.height() > kMaxRingSide)
    return false;
  ring_.blobs[ring_.count++] = arc;
  PixelBox box = blobs[arc].box;
  std::int32_t least = blobs[arc].area;
  std::int32_t sum = blobs[arc].area;
  for (std::size_t k = 0; k < ring_.count; ++k) {
    const PixelBox& of_k = blobs[ring_.blobs[k]].box;
    const auto first = std::partition_point(open.begin(), open.end(), [&](std::uint32_t i) {
      return blobs[i].box.v_min < of_k.v_min - kMaxRingSide - kMaxGap;
    });
    for (auto it = first; it != open.end() && blobs[*it].box.v_min <= of_k.v_max + kMaxGap + 1;
         ++it) {
      const Blob& blob = blobs[*it];
      const auto members = ring_.members();
      if (is_taken_[*it] != 0 || blob.area < kLeastLed || gap_between(of_k, blob.box) > kMaxGap ||
          std::find(members.begin(), members.end(), *it) != members.end())
        continue;
      box.include(blob.box);
      if (ring_.count == ring_.blobs.size() || box.width() > kMaxRingSide ||
          box.height() > kMaxRingSide)
        return false;
      ring_.blobs[ring_.count++] = *it;
      least = std::min(least, blob.area);
      sum += blob.area;
    }
  }
  if (static_cast<std::size_t>(sum) > kMostPixels || ring_.count < 2) return false;
  has_led_ = blobs[arc].area >= (ring_.count == 2 ? kLongArcArea : kArcArea) * least;
  const auto members = ring_.members();
  return has_led_ || std::all_of(members.begin(), members.end(), [&](std::uint32_t i) {
           return blobs[i].elongation() >= kArcElongation;
         });
}

bool ArcJoiner::is_ring(std::span<const Blob> blobs, const BlobFinder& finder) {
  const auto fit = [&] {
    pixels_.clear();
    for (const std::uint32_t i : ring_.members())
      finder.visit(i, blobs[i].box, [&](int u, int v) { pixels_.emplace_back(u, v); });
    return fit_ellipse(pixels_);
  };
  auto view = fit();
  if (!view || view->roundness() < kMinArcRoundness) return false;
  auto* const last = ring_.blobs.begin() + static_cast<std::ptrdiff_t>(ring_.count);
  auto* const lens = std::find_if(ring_.blobs.begin(), last, [&](std::uint32_t i) {
    return view->place_near({blobs[i].mean_u(), blobs[i].mean_v()}).norm() < kHole;
  });
  if (lens != last && ring_.count > 2) {
    std::swap(*lens, ring_.blobs[--ring_.count]);
    view = fit();
    if (!view || view->roundness() < kMinArcRoundness) return false;
  }
  std::int32_t led = blobs[ring_.blobs[0]].area;
  for (const std::uint32_t i : ring_.members()) led = std::min(led, blobs[i].area);
  ring_.view = *view;
  const Eigen::Matrix2d to_place = view->axes.inverse();
  const Length length = length_of(*view, to_place, pixels_);
  const double width = has_led_ ? std::sqrt(4.0 * led / std::numbers::pi)
                                : static_cast<double>(pixels_.size()) / length.lit;
  const double radius = view->radius();
  if (2.0 * radius * view->roundness() < width + kLeastHole || 2.0 * radius > kMaxRingSide)
    return false;
  const auto members = ring_.members();
  const bool are_curved =
      has_led_ || std::all_of(members.begin(), members.end(), [&](auto i) {
        return view->place_near({blobs[i].mean_u(), blobs[i].mean_v()}).norm() <= kArcMiddle;
      });
  if (!are_curved) return false;
  const bool are_near = std::all_of(pixels_.begin(), pixels_.end(), [&](const Eigen::Vector2d& uv) {
    return distance_from(*view, to_place, uv) <= 0.5 * width + kOffEllipse;
  });
  return are_near && length.lit >= (has_led_ ? kLeastCovered : kArcsCovered) * length.whole;
}

/// The blobs are all those that were gathered: a square's lens is not among them.
bool ArcJoiner::is_square(std::span<const Blob> blobs, const BlobFinder& finder) {
  if (!has_led_ || ring_.count < kLeastOfSquare) return false;
  pixels_.clear();
  std::int32_t led = blobs[ring_.blobs[0]].area;
  for (const std::uint32_t i : ring_.members()) {
    finder.visit(i, blobs[i].box, [&](int u, int v) { pixels_.emplace_back(u, v); });
    led = std::min(led, blobs[i].area);
  }
  const auto ellipse = fit_ellipse(pixels_);
  if (!ellipse || ellipse->roundness() < 0.5 * kMinArcRoundness) return false;
  const auto outline = fit_square(pixels_, *ellipse);
  if (!outline) return false;
  ring_.view = outline->view();
  const double width = std::sqrt(4.0 * led / std::numbers::pi);
  const double radius = ring_.view.radius();
  if (ring_.view.roundness() < kMinArcRoundness || 2.0 * radius > kMaxRingSide ||
      2.0 * std::min(outline->pairs[0].half, outline->pairs[1].half) < width + kLeastHole)
    return false;
  const bool are_near = std::all_of(pixels_.begin(), pixels_.end(), [&](const Eigen::Vector2d& uv) {
    return outline->distance_from(uv) <= 0.5 * width + kOffEllipse;
  });
  return are_near && share_covered(*outline, pixels_) >= kLeastCovered;
}

/// Least squares of  x^2 + y^2 + a (x^2 - y^2) + b 2 x y + d x + e y + f,  which has the same
/// solution in whatever direction the axes lie.
std::optional<RingView> fit_ellipse(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) middle += p;
  middle /= static_cast<double>(points.size());
  double spread = 0.0;
  for (const Eigen::Vector2d& p : points) spread += (p - middle).squaredNorm();
  spread = std::sqrt(spread / static_cast<double>(points.size()));
  using Matrix5 = Eigen::Matrix<double, 5, 5>;
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  Matrix5 normal = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  for (const Eigen::Vector2d& p : points) {
    const double x = (p.x() - middle.x()) / spread;
    const double y = (p.y() - middle.y()) / spread;
    Vector5 row;
    row << x * x - y * y, 2.0 * x * y, x, y, 1.0;
    normal.noalias() += row * row.transpose();
    right -= (x * x + y * y) * row;
  }
  const Vector5 s = normal.ldlt().solve(right);
  Eigen::Matrix2d Q;
  Q << 1.0 + s(0), s(1), s(1), 1.0 - s(0);
  if (!s.allFinite() || !(Q.determinant() > 0.0)) return std::nullopt;
  const Eigen::Vector2d center = -0.5 * Q.inverse() * Eigen::Vector2d(s(2), s(3));
  const double level = center.dot(Q * center) - s(4);
  if (!(level > 0.0)) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(Q / level);
  RingView view;
  view.center = middle + spread * center;
  view.axes =
      spread * axes.eigenvectors() * axes.eigenvalues().cwiseSqrt().cwiseInverse().asDiagonal();
  return view;
}

}  // namespace crepes
