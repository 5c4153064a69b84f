/// Where the files are that tests read and the programs that they start. Said in one object alone,
/// so that all others are the same in every checkout.
#pragma once

#include <string>

namespace crepes {

std::string source_dir();  ///< the root of the sources, absolute
std::string crepesd_path();
std::string crepesctl_path();

}  // namespace crepes
