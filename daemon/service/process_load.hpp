/// CPU time and memory of this process.
#pragma once

namespace crepes {

/// CPU time of all threads so far [s].
[[nodiscard]] double process_cpu_s();

/// Resident memory [10^6 bytes]; NaN if /proc cannot be read.
[[nodiscard]] double process_rss_mb();

}  // namespace crepes
