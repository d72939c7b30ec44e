#include "tools/stage_clock.h"

#include <ctime>

namespace scree {
namespace {

std::int64_t thread_cpu_ns() {
    timespec t{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return std::int64_t{t.tv_sec} * 1'000'000'000 + t.tv_nsec;
}

}  // namespace

std::array<std::atomic<std::int64_t>, kStages> StageClock::nanoseconds_{};

StageClock::Scope::Scope(Stage stage) : stage_(stage), start_ns_(thread_cpu_ns()) {}
StageClock::Scope::~Scope() { change(stage_); }

void StageClock::Scope::change(Stage stage) {
    const std::int64_t now = thread_cpu_ns();
    nanoseconds_[static_cast<std::size_t>(stage_)].fetch_add(now - start_ns_, std::memory_order_relaxed);
    stage_ = stage;
    start_ns_ = now;
}

double StageClock::seconds(Stage stage) {
    return static_cast<double>(nanoseconds_[static_cast<std::size_t>(stage)].load(std::memory_order_relaxed)) * 1e-9;
}

void StageClock::reset() {
    for (auto& n : nanoseconds_) n.store(0, std::memory_order_relaxed);
}

}  // namespace scree
