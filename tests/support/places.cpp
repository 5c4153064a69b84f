#include "tests/support/places.hpp"

namespace crepes {

std::string source_dir() { return CREPES_SOURCE_DIR; }
std::string crepesd_path() { return CREPES_DAEMON; }
std::string crepesctl_path() { return CREPES_TOOL; }

}  // namespace crepes
