/// Pictures as the daemon sends them to tools.
#pragma once

#include <string>

#include "daemon/stages/picture_tap.hpp"

namespace crepes {

/// A `picture`, whole: see `recorder_stage.hpp`.
void append_picture(std::string& text, const Frame& frame);

/// A `look`: what the detector found, the robots that were identified in this very picture, and the
/// picture reduced to at most kMaxLookSide a side. Of the pixels that become one, the brightest
/// counts, so that no light is lost.
inline constexpr int kMaxLookSide = 800;
void append_look(std::string& text, const Picture& picture, const PictureRobots* robots);

}  // namespace crepes
