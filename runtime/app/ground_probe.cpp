#include "runtime/app/ground_probe.h"

#include <utility>

#include "common/query/ground.h"

namespace scree {

GroundProbe::GroundProbe(std::shared_ptr<const SqliteStore> store)
    : question_{std::move(store)}, thread_([this] { run(); }) {}

GroundProbe::~GroundProbe() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    asked_.notify_all();
    thread_.join();
}

void GroundProbe::use(std::shared_ptr<const SqliteStore> store) {
    const std::lock_guard lock(mutex_);
    open_ = open_ || question_.store != store;
    question_.store = std::move(store);
}

std::optional<double> GroundProbe::height_m(double x_m, double y_m) {
    std::optional<double> answer;
    {
        const std::lock_guard lock(mutex_);
        const Question next{question_.store, x_m, y_m};
        open_ = open_ || !(next == question_);
        question_ = next;
        answer = answer_m_;
        if (!open_) return answer;
    }
    asked_.notify_all();
    return answer;
}

void GroundProbe::run() {
    std::shared_ptr<const SqliteStore> store;  // outlives its ground
    std::unique_ptr<Ground> ground;
    std::unique_lock lock(mutex_);
    for (;;) {
        asked_.wait(lock, [this] { return stopping_ || open_; });
        if (stopping_) return;
        const Question question = question_;
        open_ = false;
        lock.unlock();
        if (question.store != store || !ground) {
            ground.reset();
            store = question.store;
            if (auto opened = Ground::open(*store)) ground = std::move(*opened);
        }
        std::optional<double> answer_m;
        if (ground)
            if (auto height = ground->height(question.x_m, question.y_m); height && *height)
                answer_m = (*height)->height_m;
        lock.lock();
        answer_m_ = answer_m;
    }
}

}  // namespace scree
