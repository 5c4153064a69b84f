#include "drivers/sim/ring_renderer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/core/constants.hpp"

namespace crepes {
namespace {

constexpr double kRingRadius = 0.03;  // m
constexpr int kLeds = 6;
constexpr double kExposure = 0.0005;             // s
constexpr double kHalfField = radians(92.5);     // of the lens, whatever the sensor's size
constexpr double kBlur = 0.8;                    // px, one sigma of an LED's image
constexpr double kPeakAtOneMeter = 7500.0;       // grey levels of one LED; pixels saturate at 255
constexpr double kFaintest = 0.3;                // grey levels; fainter light is ignored
constexpr double kMisalignment = radians(0.15);  // rad, one sigma an axis
constexpr double kOscillatorPpm = 20.0;          // one sigma
constexpr float kDarkLevel = 10.0F;
constexpr double kPixelNoise = 1.5;        // grey levels, one sigma
constexpr std::size_t kGrain = 1U << 14U;  // a power of two
constexpr std::size_t kMaxLoaned = 8;

constexpr std::uint64_t kCameraKey = 0x63616dU;
constexpr std::uint64_t kBoardKey = 0x6c6564U;

std::uint8_t to_grey(float level) {
  return static_cast<std::uint8_t>(std::clamp(level + 0.5F, 0.0F, 255.0F));
}

/// Radius of a blob [px].
int reach_of(double peak) {
  return static_cast<int>(std::ceil(kBlur * std::sqrt(2.0 * std::log(peak / kFaintest))));
}

}  // namespace

Result<RingRenderer> RingRenderer::make(const SimWorld& world, RobotId robot,
                                        const SwarmConfig& swarm, const CameraCalibration& camera,
                                        std::uint8_t index) {
  const auto model = CameraModel::from(camera);
  if (!model) return tl::unexpected(model.error());
  RingRenderer renderer(world, robot, *model, camera, index);
  for (const MemberConfig& member : swarm.members) {
    if (!world.contains(member.id)) {
      return fail(ErrorCode::kConfig,
                  fmt::format("simulated board of robot {}: the scenario has no such robot",
                              member.id.value));
    }
    if (member.id == robot) continue;
    auto code = BlinkCode::from(member, swarm);
    if (!code) return tl::unexpected(code.error());
    const SeededNoise noise{kBoardKey, static_cast<std::uint64_t>(world.seed()), member.id.value};
    const double phase_s = 10.0 * noise.uniform(0);
    const double rate = 1.0 + 1e-6 * kOscillatorPpm * noise.gaussian(1);
    renderer.boards_.push_back({member.id, member.p_body_led, std::move(*code), phase_s, rate});
  }
  return renderer;
}

RingRenderer::RingRenderer(const SimWorld& world, RobotId robot, CameraModel model,
                           const CameraCalibration& camera, std::uint8_t index)
    : world_(world),
      robot_(robot),
      model_(std::move(model)),
      index_(index),
      T_C_B_(camera.T_cam_imu),
      row_delay_s_(1e-6 * camera.rolling_shutter_us_per_row),
      noise_{kCameraKey, static_cast<std::uint64_t>(world.seed()), robot.value, index} {
  T_C_B_.q = so3_exp(kMisalignment * noise_.gaussian3(0)) * T_C_B_.q;
  grain_.resize(kGrain);
  for (std::size_t i = 0; i < kGrain; ++i) {
    grain_[i] = static_cast<float>(kPixelNoise * noise_.gaussian(100 + i));
  }
  // Rows start at different positions in the grain, so that no pattern is visible.
  const auto width = static_cast<std::size_t>(model_.width());
  for (std::size_t row = 0; row < static_cast<std::size_t>(model_.height()); ++row) {
    const auto shift = static_cast<std::size_t>(kGrain * noise_.uniform(row));
    for (std::size_t column = 0; column < width; ++column) {
      background_.push_back(to_grey(kDarkLevel + grain_[(shift + column) % kGrain]));
    }
  }
}

std::optional<Eigen::Vector2d> RingRenderer::project_ring(RobotId neighbor, double t_s) const {
  const auto board = std::find_if(boards_.begin(), boards_.end(),
                                  [&](const Board& b) { return b.robot == neighbor; });
  if (board == boards_.end()) return std::nullopt;
  return project(world_.T_W_B(neighbor, t_s) * board->p_body_led, t_s);
}

std::optional<Eigen::Vector2d> RingRenderer::project(const Eigen::Vector3d& p_W, double t_s) const {
  const Pose T_W_B = world_.T_W_B(robot_, t_s);
  if (world_.is_occluded(T_W_B * T_C_B_.inverse().p, p_W)) return std::nullopt;
  return image_of(T_C_B_ * (T_W_B.inverse() * p_W));
}

std::optional<Eigen::Vector2d> RingRenderer::image_of(const Eigen::Vector3d& p_C) const {
  if (p_C.z() < std::cos(kHalfField) * p_C.norm()) return std::nullopt;
  const auto uv = model_.project(p_C);
  return uv && model_.contains(*uv) ? uv : std::nullopt;
}

double RingRenderer::exposure_s(const Board& board, double t_s) const {
  constexpr int kRounds = 2;  // the row moves little while the rows are read
  double exposed_s = t_s;
  for (int round = 0; row_delay_s_ != 0.0 && round < kRounds; ++round) {
    const auto uv = project_ring(board.robot, exposed_s);
    if (uv) exposed_s = t_s + row_delay_s_ * (uv->y() - 0.5 * (model_.height() - 1));
  }
  return exposed_s;
}

std::vector<RingRenderer::View> RingRenderer::views(double t_s) const {
  std::vector<View> views;
  for (const Board& board : boards_) {
    const double exposed_s = exposure_s(board, t_s);
    const auto center = project_ring(board.robot, exposed_s);
    const std::vector<Blob> blobs = blobs_of(board, exposed_s);
    if (!center || blobs.empty()) continue;
    double reach = 0.0;
    double peak = 0.0;
    for (const Blob& blob : blobs) {
      reach = std::max(reach, (blob.center - *center).norm());
      peak = std::max(peak, blob.peak);
    }
    const double radius = reach + 2.0 * kBlur;
    views.push_back({board.robot,
                     {.u_px = center->x(),
                      .v_px = center->y(),
                      .area_px2 = std::numbers::pi * radius * radius,
                      .peak = std::min(255.0, kDarkLevel + peak)}});
  }
  return views;
}

std::vector<RingRenderer::Blob> RingRenderer::blobs_of(const Board& board, double t_s) const {
  const auto board_time = [&](double t) { return from_seconds(board.phase_s + t * board.rate); };
  const double lit =
      board.code.lit_fraction(board_time(t_s - kExposure / 2.0), board_time(t_s + kExposure / 2.0));
  if (lit <= 0.0) return {};
  const Pose T_W_B = world_.T_W_B(robot_, t_s);
  const Pose T_W_N = world_.T_W_B(board.robot, t_s);
  if (world_.is_occluded(T_W_B * T_C_B_.inverse().p, T_W_N * board.p_body_led)) return {};
  const Pose T_C_N = T_C_B_ * (T_W_B.inverse() * T_W_N);

  std::vector<Blob> blobs;
  for (int led = 0; led < kLeds; ++led) {
    const double angle = 2.0 * std::numbers::pi * led / kLeds;
    const Eigen::Vector3d offset(0.0, kRingRadius * std::cos(angle), kRingRadius * std::sin(angle));
    const Eigen::Vector3d p_C = T_C_N * (board.p_body_led + offset);
    // The LEDs face forward; their intensity decreases towards the side.
    const double forward = -(T_C_N.q * Eigen::Vector3d::UnitX()).dot(p_C.normalized());
    if (forward <= 0.0) continue;
    const double peak = lit * brightness_ * kPeakAtOneMeter * (0.3 + 0.7 * forward) /
                        std::max(p_C.squaredNorm(), 0.01);
    if (peak <= kFaintest) continue;
    if (const auto uv = image_of(p_C)) blobs.push_back({*uv, peak});
  }
  return blobs;
}

RingRenderer::Rectangle RingRenderer::draw(const std::vector<Blob>& blobs,
                                           std::vector<std::uint8_t>& pixels) {
  Rectangle box{model_.width(), model_.height(), 0, 0};
  for (const Blob& blob : blobs) {
    const int reach = reach_of(blob.peak);
    const auto u = static_cast<int>(std::lround(blob.center.x()));
    const auto v = static_cast<int>(std::lround(blob.center.y()));
    box.left = std::max(0, std::min(box.left, u - reach));
    box.top = std::max(0, std::min(box.top, v - reach));
    box.right = std::min(model_.width(), std::max(box.right, u + reach + 1));
    box.bottom = std::min(model_.height(), std::max(box.bottom, v + reach + 1));
  }
  const auto columns = static_cast<std::size_t>(box.right - box.left);
  const auto rows = static_cast<std::size_t>(box.bottom - box.top);
  light_.assign(columns * rows, 0.0F);
  std::vector<float> across(columns);
  for (const Blob& blob : blobs) {
    const auto gauss = [](double d) { return std::exp(-d * d / (2.0 * kBlur * kBlur)); };
    for (std::size_t c = 0; c < columns; ++c) {
      across[c] = static_cast<float>(gauss(box.left + static_cast<double>(c) - blob.center.x()));
    }
    for (std::size_t r = 0; r < rows; ++r) {
      const auto down =
          static_cast<float>(blob.peak * gauss(box.top + static_cast<double>(r) - blob.center.y()));
      if (down < kFaintest) continue;
      for (std::size_t c = 0; c < columns; ++c) light_[r * columns + c] += down * across[c];
    }
  }
  auto grain = static_cast<std::size_t>(kGrain * noise_.uniform(1'000'000 + frame_));
  for (std::size_t r = 0; r < rows; ++r) {
    std::uint8_t* row =
        pixels.data() +
        (static_cast<std::size_t>(box.top) + r) * static_cast<std::size_t>(model_.width()) +
        static_cast<std::size_t>(box.left);
    for (std::size_t c = 0; c < columns; ++c) {
      const float seen = row[c];
      row[c] = to_grey(seen + light_[r * columns + c] + grain_[grain++ % kGrain]);
    }
  }
  return box;
}

std::vector<std::uint8_t> RingRenderer::clean_pixels() {
  if (clean_.empty()) return background_;
  std::vector<std::uint8_t> pixels = std::move(clean_.back());
  clean_.pop_back();
  return pixels;
}

Frame RingRenderer::render(double t_s) {
  ++frame_;
  Frame frame{.camera = index_,
              .width = model_.width(),
              .height = model_.height(),
              .pixels = clean_pixels()};
  LoanedFrame loaned{frame.pixels.data(), {}};
  for (const Board& board : boards_) {
    const std::vector<Blob> blobs = blobs_of(board, exposure_s(board, t_s));
    if (!blobs.empty()) loaned.touched.push_back(draw(blobs, frame.pixels));
  }
  // The memory of this frame may be that of an earlier frame that was never recycled.
  std::erase_if(loaned_, [&](const LoanedFrame& other) { return other.pixels == loaned.pixels; });
  if (loaned_.size() == kMaxLoaned) loaned_.erase(loaned_.begin());
  loaned_.push_back(std::move(loaned));
  return frame;
}

void RingRenderer::recycle(Frame frame) {
  const auto loaned = std::find_if(
      loaned_.begin(), loaned_.end(),
      [&](const LoanedFrame& candidate) { return candidate.pixels == frame.pixels.data(); });
  if (loaned == loaned_.end() || frame.pixels.size() != background_.size()) return;
  for (const Rectangle& box : loaned->touched) {
    for (int row = box.top; row < box.bottom; ++row) {
      const std::ptrdiff_t line = static_cast<std::ptrdiff_t>(row) * model_.width();
      std::copy(background_.begin() + line + box.left, background_.begin() + line + box.right,
                frame.pixels.begin() + line + box.left);
    }
  }
  loaned_.erase(loaned);
  clean_.push_back(std::move(frame.pixels));
}

}  // namespace crepes
