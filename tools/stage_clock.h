// Where a build's CPU seconds go. Scopes of several threads add up; scopes do not nest.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace scree {

enum class Stage : std::size_t { decode, warp, filter, encode, error, store };
inline constexpr std::size_t kStages = 6;

class StageClock {
public:
    /// Adds the thread's CPU time from construction to destruction. Two clock readings: about half a microsecond, so
    /// for work of 50 microseconds and more.
    class Scope {
    public:
        explicit Scope(Stage stage);
        ~Scope();
        /// What follows is of another stage. One clock reading.
        void change(Stage stage);
        Scope(const Scope&) = delete;
        Scope& operator=(const Scope&) = delete;

    private:
        Stage stage_;
        std::int64_t start_ns_;
    };

    /// Of all threads since the last reset.
    static double seconds(Stage stage);
    static void reset();

private:
    static std::array<std::atomic<std::int64_t>, kStages> nanoseconds_;
};

}  // namespace scree
