/// The loop that finds the spots in the frames of one camera.
#pragma once

#include <stop_token>
#include <string>

#include "daemon/devices/camera_sensor.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/stage_context.hpp"
#include "estimator/vision/vision_config.hpp"

namespace crepes {

/// Copies of pictures for the recorder. A picture is copied only on request.
struct PictureTap {
  struct Request {};
  BoundedQueue<Request> requests{1, Overflow::kDropNewest};
  BoundedQueue<Frame> pictures{1, Overflow::kDropNewest};
};

/// All references must outlive the stage.
struct VisionStage {
  std::string camera_name;
  bool is_calibrated;
  LiveSettings<VisionConfig>& settings;
  FrameQueue& frames;
  FrameQueue& recycled;
  PictureTap& tap;
  EventSink sink;
};

void run_vision(const VisionStage& stage, const StageContext& context, const std::stop_token& stop);

}  // namespace crepes
