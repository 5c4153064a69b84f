/// The loop that sends measurements and pictures to tools, over a Unix socket.
///
/// A tool sends a line and receives blocks until it closes the connection. A block is a line `KIND
/// BYTES`, then that number of bytes. `RECORD 1` or `RECORD 1 pictures` asks for everything from
/// now on, and is for one tool at a time; `LOOK 1 CAMERA` asks for one picture, and may be
/// repeated.
///   config      the active configuration, as YAML; again after a reload
///   imu0, uwb0, cam<k>   rows of the data set's CSV files
///   picture     a line `CAMERA T_NS WIDTH HEIGHT`, and grey levels row by row
///   gap         the number of events that are missing here
///   look        a line of JSON, and grey levels of a reduced picture row by row: `camera`, `t_ns`
///               (as text), `width` and `height` of what follows, `scale` (pixels of the camera to
///               one), `background`, `threshold`, `saturated` (0..1), `hot_pixels` (how many are
///               known), `hot` (rows u, v of some), `spots` (rows u, v, area, peak), `robots` (rows
///               id and the unit direction in the body: those that were identified in this picture)
///   refused     the reason why there is nothing
#pragma once

#include <deque>
#include <stop_token>

#include "config/schema/config.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/picture_tap.hpp"
#include "daemon/stages/stage_context.hpp"
#include "estimator/core/event.hpp"

namespace crepes {

using RecordQueue = BoundedQueue<Event>;

/// All references must outlive the stage.
struct RecorderStage {
  LiveSettings<Config>& settings;
  RecordQueue& events;
  std::deque<PictureTap>& pictures;  ///< of each camera
  PictureRobotsQueue& sightings;
};

/// Serves at most four tools at a time, until `stop`. A recording tool that reads too slowly loses
/// the newest events and receives their number. A viewer receives one picture for each request, and
/// costs nothing between requests.
void run_recorder(const RecorderStage& stage, const StageContext& context,
                  const std::stop_token& stop);

}  // namespace crepes
