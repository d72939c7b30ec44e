// What the operating system has charged to this process so far.
#pragma once

#include <cstdint>

namespace scree {

struct ProcessUsage {
    double cpu_seconds = 0;  ///< user + system
    std::int64_t peak_rss_bytes = 0;
};

ProcessUsage process_usage();

/// CPU time of the calling thread so far, seconds.
double thread_cpu_seconds();

/// Resident memory of this process now, bytes.
std::int64_t resident_bytes();

}  // namespace scree
