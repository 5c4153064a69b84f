/// The loop that sends measurements to `crepesctl record`, over a Unix socket.
///
/// The tool sends one line, `RECORD 1` or `RECORD 1 pictures`, and receives blocks until it hangs
/// up:
/// a line `KIND BYTES`, then that number of bytes.
/// config      the active configuration, as YAML; again after a reload
///   imu0, uwb0, cam<k>   rows of the data set's CSV files
///   picture     a line `CAMERA T_NS WIDTH HEIGHT`, and grey levels row by row
///   gap         the number of events that are missing here
/// refused     the reason why there is no recording
#pragma once

#include <deque>
#include <stop_token>
#include <string>

#include "config/schema/config.hpp"
#include "daemon/stages/bounded_queue.hpp"
#include "daemon/stages/live_settings.hpp"
#include "daemon/stages/stage_context.hpp"
#include "daemon/stages/vision_stage.hpp"
#include "estimator/core/event.hpp"

namespace crepes {

inline constexpr std::string_view kRecordRequest = "RECORD 1";
inline constexpr std::string_view kPicturesRequest = "RECORD 1 pictures";

using RecordQueue = BoundedQueue<Event>;

/// All references must outlive the stage.
struct RecorderStage {
  LiveSettings<Config>& settings;
  RecordQueue& events;
  std::deque<PictureTap>& pictures;  ///< of each camera
};

/// Serves one recording at a time until `stop`. A tool that reads too slowly loses the newest
/// events and receives their number.
void run_recorder(const RecorderStage& stage, const StageContext& context,
                  const std::stop_token& stop);

}  // namespace crepes
