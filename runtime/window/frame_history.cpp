#include "runtime/window/frame_history.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace scree {

void FrameHistory::add(double frame_ms) {
    if (!(frame_ms >= 0) || frame_ms > std::numeric_limits<float>::max()) return;
    times_ms_[next_] = times_ms_[next_ + kFramesKept] = static_cast<float>(frame_ms);
    next_ = (next_ + 1) % kFramesKept;
    count_ = std::min(count_ + 1, kFramesKept);
}

double FrameHistory::mean_ms() const {
    if (count_ == 0) return 0;
    const auto times = times_ms();
    return std::accumulate(times.begin(), times.end(), 0.0) / static_cast<double>(count_);
}

double FrameHistory::max_ms() const {
    if (count_ == 0) return 0;
    const auto times = times_ms();
    return *std::max_element(times.begin(), times.end());
}

double FrameHistory::p99_ms() const {
    if (count_ == 0) return 0;
    const auto times = times_ms();
    std::array<float, kFramesKept> sorted{};
    const auto end = std::copy(times.begin(), times.end(), sorted.begin());
    const auto rank = sorted.begin() + static_cast<std::ptrdiff_t>((99 * count_ + 99) / 100 - 1);
    std::nth_element(sorted.begin(), rank, end);
    return *rank;
}

}  // namespace scree
