/// Pictures of LED boards.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/sim/seeded_noise.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/result.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {

/// Draws what one camera of one robot sees: every other board as a ring of six LEDs that blinks to
/// its code on its own oscillator, over a sensor's noise. Only the pixels near a ring are touched;
/// the rest of a recycled frame still holds the background.
class RingRenderer {
 public:
  /// Refuses a camera or codes that do not work, and members without a robot in the world.
  /// `world` must outlive this.
  [[nodiscard]] static Result<RingRenderer> make(const SimWorld& world, RobotId robot,
                                                 const SwarmConfig& swarm,
                                                 const CameraConfig& camera, std::uint8_t index);

  /// The picture at world time `t_s`, unstamped.
  [[nodiscard]] Frame render(double t_s);
  /// Takes back a frame of `render` whose pixels have not been changed.
  void recycle(Frame frame);

  /// A lit board in view, as a flawless detector would find it.
  struct View {
    RobotId robot{};
    Spot spot;
  };
  [[nodiscard]] std::vector<View> views(double t_s) const;

  /// The pixel that sees a point of the world, if nothing is in the way. With the camera's own
  /// misalignment.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_W,
                                                       double t_s) const;

  /// The pixel where the center of a board's ring appears, if the camera looks at it unhindered,
  /// lit or not. This is truth: with the camera's own misalignment.
  [[nodiscard]] std::optional<Eigen::Vector2d> project_ring(RobotId neighbor, double t_s) const;

 private:
  struct Board {
    RobotId robot{};
    Eigen::Vector3d p_body_led = Eigen::Vector3d::Zero();
    BlinkCode code;
    double phase_s = 0.0;  ///< of the board's clock at world time 0
    double rate = 1.0;     ///< of the board's clock
  };
  struct Rectangle {
    int left, top, right, bottom;  ///< right and bottom excluded
  };
  struct Lent {
    const std::uint8_t* pixels;  ///< tells the frame
    std::vector<Rectangle> touched;
  };
  /// An LED as the camera sees it.
  struct Blob {
    Eigen::Vector2d center;
    double peak;  ///< grey levels above the background
  };

  RingRenderer(const SimWorld& world, RobotId robot, CameraModel model, const CameraConfig& camera,
               std::uint8_t index);

  [[nodiscard]] std::vector<Blob> blobs_of(const Board& board, double t_s) const;
  [[nodiscard]] Rectangle draw(const std::vector<Blob>& blobs, std::vector<std::uint8_t>& pixels);
  [[nodiscard]] std::vector<std::uint8_t> clean_pixels();

  const SimWorld& world_;
  RobotId robot_;
  CameraModel model_;
  std::uint8_t index_;
  Pose T_C_B_;  ///< the true one
  SeededNoise noise_;
  std::vector<Board> boards_;
  std::vector<std::uint8_t> background_;
  std::vector<float> grain_;  ///< noise to draw from, in grey levels
  std::vector<float> light_;  ///< scratch of draw()
  std::uint64_t frame_ = 0;
  std::vector<Lent> lent_;                        ///< frames that are away, oldest first
  std::vector<std::vector<std::uint8_t>> clean_;  ///< came back and show the background
};

}  // namespace crepes
