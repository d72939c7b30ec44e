// GroundProbe: the height of the ground under a moving eye, read on a thread of its own: a frame waits neither for a
// disk nor for a program that commits an update.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "common/store/sqlite_store.h"

namespace scree {

/// The frame-loop thread calls; nothing waits.
class GroundProbe {
public:
    explicit GroundProbe(std::shared_ptr<const SqliteStore> store);
    ~GroundProbe();
    GroundProbe(const GroundProbe&) = delete;
    GroundProbe& operator=(const GroundProbe&) = delete;

    /// From now on heights are those of `store`.
    void use(std::shared_ptr<const SqliteStore> store);
    /// Asks for the height at a place and returns the last answer, metres: as a rule that of the call before. None
    /// where there was no ground, or none could be read.
    std::optional<double> height_m(double x_m, double y_m);

private:
    struct Question {
        std::shared_ptr<const SqliteStore> store;
        double x_m = 0, y_m = 0;
        bool operator==(const Question&) const = default;
    };
    void run();

    std::mutex mutex_;
    std::condition_variable asked_;
    Question question_;
    bool open_ = false;  ///< a question is not taken yet
    bool stopping_ = false;
    std::optional<double> answer_m_;
    std::thread thread_;
};

}  // namespace scree
