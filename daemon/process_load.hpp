/// What this process takes of the machine.
#pragma once

namespace crepes {

/// CPU time of all threads so far [s].
[[nodiscard]] double process_cpu_s();

/// Resident memory [10^6 bytes]; NaN where /proc does not tell.
[[nodiscard]] double process_rss_mb();

}  // namespace crepes
