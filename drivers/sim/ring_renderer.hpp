/// Rendered images of LED boards.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera/camera.hpp"
#include "drivers/sim/seeded_noise.hpp"
#include "drivers/sim/world.hpp"
#include "estimator/core/camera_calibration.hpp"
#include "estimator/core/result.hpp"
#include "estimator/core/swarm_config.hpp"
#include "estimator/vision/camera_model.hpp"
#include "estimator/vision/id_library.hpp"

namespace crepes {

/// Renders the image of one camera of one robot. Every other board is a ring of six LEDs that
/// blinks its code on its own oscillator, over sensor noise. Only pixels near a ring are written;
/// the rest of a recycled frame still holds the background.
class RingRenderer {
 public:
  /// Refuses invalid cameras and codes, and members without a robot in the world. `world` must
  /// outlive this.
  [[nodiscard]] static Result<RingRenderer> make(const SimWorld& world, RobotId robot,
                                                 const SwarmConfig& swarm,
                                                 const CameraCalibration& camera,
                                                 std::uint8_t index);

  /// The image at world time `t_s`, unstamped.
  [[nodiscard]] Frame render(double t_s);
  /// Accepts a frame of `render` for reuse; its pixels must be unchanged.
  void recycle(Frame frame);

  /// How the camera truly is mounted.
  [[nodiscard]] const Pose& T_C_B() const { return T_C_B_; }

  /// LEDs appear this many times as bright as at first.
  void set_brightness(double factor) { brightness_ = factor; }

  /// A lit board in view, as an ideal detector reports it.
  struct View {
    RobotId robot{};
    Spot spot;
  };
  [[nodiscard]] std::vector<View> views(double t_s) const;

  /// The pixel of a world point, if it is not occluded. Includes the camera's true misalignment.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_W,
                                                       double t_s) const;

  /// The true pixel of the center of a board's ring, lit or not, if it is in view and not occluded.
  /// Includes the camera's true misalignment.
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
  struct LoanedFrame {
    const std::uint8_t* pixels;  ///< identifies the frame
    std::vector<Rectangle> touched;
  };
  /// The image of an LED.
  struct Blob {
    Eigen::Vector2d center;
    double peak;  ///< grey levels above the background
  };

  RingRenderer(const SimWorld& world, RobotId robot, CameraModel model,
               const CameraCalibration& camera, std::uint8_t index);

  /// Where a point in the camera appears. Empty outside the lens's field of view or the sensor.
  [[nodiscard]] std::optional<Eigen::Vector2d> image_of(const Eigen::Vector3d& p_C) const;
  /// When the rows of the board's image are exposed in the frame of `t_s`.
  [[nodiscard]] double exposure_s(const Board& board, double t_s) const;
  [[nodiscard]] std::vector<Blob> blobs_of(const Board& board, double t_s) const;
  [[nodiscard]] Rectangle draw(const std::vector<Blob>& blobs, std::vector<std::uint8_t>& pixels);
  [[nodiscard]] std::vector<std::uint8_t> clean_pixels();

  const SimWorld& world_;
  RobotId robot_;
  CameraModel model_;
  std::uint8_t index_;
  Pose T_C_B_;          ///< true value
  double row_delay_s_;  ///< of a rolling shutter; frames have the time of the middle row
  SeededNoise noise_;
  std::vector<Board> boards_;
  std::vector<std::uint8_t> background_;
  std::vector<float> grain_;  ///< noise to draw from, in grey levels
  std::vector<float> light_;  ///< scratch of draw()
  double brightness_ = 1.0;
  std::uint64_t frame_ = 0;
  std::vector<LoanedFrame> loaned_;               ///< frames that are away, oldest first
  std::vector<std::vector<std::uint8_t>> clean_;  ///< came back and show the background
};

}  // namespace crepes
