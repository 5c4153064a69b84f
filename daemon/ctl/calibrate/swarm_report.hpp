/// What a swarm calibration found, as files, text and JSON.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "daemon/ctl/dataset/swarm_dataset.hpp"
#include "estimator/calibration/swarm/swarm_batch.hpp"

namespace crepes {

/// The parts of all calibrations in one file: cam0 as Kalibr's camchain, imu, ranges, and lever
/// arms of all members.
[[nodiscard]] std::string calibration_text(const SwarmBatchResult& found,
                                           const SwarmDataset& dataset, std::size_t robot);
/// The same as keys of crepesd.yaml.
[[nodiscard]] std::string fragment_text(const SwarmBatchResult& found, const SwarmDataset& dataset,
                                        std::size_t robot);
[[nodiscard]] std::string swarm_text(const SwarmBatchResult& found, const SwarmDataset& dataset,
                                     const std::filesystem::path& out);
[[nodiscard]] std::string swarm_json(const SwarmBatchResult& found, const SwarmDataset& dataset);

}  // namespace crepes
