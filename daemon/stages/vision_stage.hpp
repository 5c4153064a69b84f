/// The loop that finds the spots in the frames of one camera.
#pragma once

#include <stop_token>
#include <string>

#include "daemon/devices/camera_sensor.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/picture_tap.hpp"
#include "daemon/stages/stage_context.hpp"
#include "drivers/camera/camera_light.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

/// All references must outlive the stage.
struct VisionStage {
  std::string camera_name;
  bool is_calibrated;
  LiveSettings<VisionConfig>& settings;
  LiveSettings<LightSettings>& light_settings;
  LiveLight& light;
  PictureRobotsQueue& boards;  ///< that were identified in this camera's pictures
  FrameQueue& frames;
  FrameQueue& recycled;
  PictureTap& tap;
  EventSink sink;
};

void run_vision(const VisionStage& stage, const StageContext& context, const std::stop_token& stop);

}  // namespace crepes
