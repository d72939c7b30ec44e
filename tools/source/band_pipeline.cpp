#include "tools/source/band_pipeline.h"

#include <atomic>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace scree {
namespace {

class Run {
public:
    explicit Run(const BandPipeline& pipeline) : pipeline_(pipeline) {}

    void work(int thread) {
        while (true) {
            const std::int64_t band = next_to_make_.fetch_add(1);
            if (band >= pipeline_.bands) return;
            if (Result<void> made = guarded(pipeline_.make, thread, band); !made) return fail(made.error());
            std::unique_lock lock(mutex_);
            // The lowest unfinished band belongs to some thread that waits for nobody: no deadlock.
            turn_.wait(lock, [&] { return failed_ || next_to_write_ == band; });
            if (failed_) return;
            if (Result<void> written = guarded(pipeline_.write, thread, band); !written) {
                lock.unlock();
                return fail(written.error());
            }
            ++next_to_write_;
            turn_.notify_all();
        }
    }

    Result<void> result() const { return result_; }
    void fail(const Error& error) {
        const std::lock_guard lock(mutex_);
        if (!failed_) result_ = error;
        failed_ = true;
        next_to_make_ = pipeline_.bands;
        turn_.notify_all();
    }

private:
    static Result<void> guarded(const std::function<Result<void>(int, std::int64_t)>& call, int thread,
                                std::int64_t band) {
        try {
            return call(thread, band);
        } catch (const std::exception& problem) {
            return Error{ErrorCode::io, std::string("out of resources: ") + problem.what()};
        }
    }

    const BandPipeline& pipeline_;
    std::atomic<std::int64_t> next_to_make_{0};
    std::mutex mutex_;
    std::condition_variable turn_;
    std::int64_t next_to_write_ = 0;
    bool failed_ = false;
    Result<void> result_;
};

}  // namespace

Result<void> run_bands(const BandPipeline& pipeline) {
    Run run(pipeline);
    std::vector<std::jthread> others;
    for (int thread = 1; thread < pipeline.threads; ++thread) {
        try {
            others.emplace_back([&run, thread] { run.work(thread); });
        } catch (const std::exception&) {
            break;  // fewer threads than asked for do the same work
        }
    }
    run.work(0);
    others.clear();  // joins
    return run.result();
}

}  // namespace scree
