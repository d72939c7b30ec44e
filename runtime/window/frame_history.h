// FrameHistory: the times of a window's last frames, for its head-up display. Pure; one thread.
#pragma once

#include <array>
#include <cstddef>
#include <span>

namespace scree {

/// Four seconds at 60 frames a second.
inline constexpr std::size_t kFramesKept = 240;

class FrameHistory {
public:
    /// What is no time (negative, not finite) is not kept.
    void add(double frame_ms);
    /// Oldest first, in one piece, as a graph takes it. Valid until the next add().
    std::span<const float> times_ms() const { return {times_ms_.data() + start(), count_}; }

    /// Of the frames kept; 0 where there are none.
    double mean_ms() const;
    double max_ms() const;
    /// The least time that 99 % of them do not pass (nearest rank).
    double p99_ms() const;

private:
    std::size_t start() const { return count_ < kFramesKept ? 0 : next_; }

    /// Every time stands twice, kFramesKept apart: the last ones are contiguous wherever the ring begins.
    std::array<float, 2 * kFramesKept> times_ms_{};
    std::size_t next_ = 0, count_ = 0;
};

}  // namespace scree
