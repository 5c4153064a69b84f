/// Pictures of the scenes of vision_study with more boards than a study needs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tests/study/vision_scene.hpp"

namespace crepes::study {

/// Gray levels row by row, of the camera of a scene.
using ScenePicture = std::vector<std::uint8_t>;

/// So many pictures of a scene, each with that many boards at places of their own, all lit.
/// The camera turns as fast as it ever does in the scene.
[[nodiscard]] std::vector<ScenePicture> scene_pictures(const VisionScene& scene, std::size_t boards,
                                                       std::size_t count);

}  // namespace crepes::study
