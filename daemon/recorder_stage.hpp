/// The loop that hands measurements to `crepesctl record`, over a Unix socket.
///
/// The tool sends one line, `RECORD 1` or `RECORD 1 pictures`, and gets blocks until it hangs up:
/// a line `KIND BYTES`, and so many bytes.
///   config      the configuration in force, as YAML; again after a reload
///   imu0, uwb0, cam<k>   rows of the data set's CSV files
///   picture     a line `CAMERA T_NS WIDTH HEIGHT`, and grey levels row by row
///   gap         the number of events that are missing here
///   refused     why there is nothing
#pragma once

#include <deque>
#include <stop_token>
#include <string>

#include "daemon/bounded_queue.hpp"
#include "daemon/sensor_stages.hpp"
#include "estimator/core/config.hpp"
#include "estimator/core/event.hpp"

namespace crepes {

inline constexpr std::string_view kRecordRequest = "RECORD 1";
inline constexpr std::string_view kPicturesRequest = "RECORD 1 pictures";

using RecordQueue = BoundedQueue<Event>;

/// All references must outlive the stage.
struct RecorderStage {
  Config config;
  RecordQueue& events;
  std::deque<PictureTap>& pictures;  ///< of each camera
};

/// Serves one recording at a time until `stop`. A tool that reads too slowly loses events, the
/// newest, and is told how many.
void run_recorder(const RecorderStage& stage, const StageContext& context,
                  const std::stop_token& stop);

}  // namespace crepes
