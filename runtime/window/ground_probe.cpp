#include "runtime/window/ground_probe.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "common/query/ground.h"
#include "runtime/window/curved_ray.h"

namespace scree {
namespace {

/// Heights of a profile that are read before others' questions are looked at again.
constexpr int kProfileSlice = 16;

bool finite(const glm::dvec2& v) { return std::isfinite(v.x) && std::isfinite(v.y); }

/// What a store says by an error or an exception is no answer.
template <class Ask>
auto answer_or_none(const Ask& ask) -> decltype(ask()) {
    try {
        return ask();
    } catch (const std::exception&) {
        return {};
    }
}

std::optional<double> height_of(Ground* ground, const glm::dvec2& place) {
    return answer_or_none([&]() -> std::optional<double> {
        if (ground == nullptr) return {};
        auto height = ground->height(place.x, place.y);
        if (!height || !*height) return {};
        return (*height)->height_m;
    });
}

}  // namespace

struct GroundProbe::Work {
    std::shared_ptr<const TileStore> store;  // outlives its ground
    std::unique_ptr<Ground> ground;
    std::uint64_t state = 0;
    std::size_t last_kind = 0;
    std::optional<Profile> profile;
    int profile_count = 0;

    /// Null where the store cannot be read; tried again by the next question.
    Ground* open(const std::shared_ptr<const TileStore>& wanted) {
        if (wanted == store && ground) return ground.get();
        ground.reset();
        store = wanted;
        if (store == nullptr) return nullptr;
        ground = answer_or_none([&]() -> std::unique_ptr<Ground> {
            auto opened = Ground::open(*store);
            return opened ? std::move(*opened) : nullptr;
        });
        return ground.get();
    }
};

GroundProbe::GroundProbe(std::shared_ptr<const TileStore> store, std::function<void()> on_answer)
    : on_answer_(std::move(on_answer)), store_(std::move(store)), thread_([this] { run(); }) {}

GroundProbe::~GroundProbe() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    asked_.notify_all();
    thread_.join();
}

void GroundProbe::use(std::shared_ptr<const TileStore> store) {
    std::shared_ptr<const Profile> forgotten;  // freed without the lock
    {
        const std::lock_guard lock(mutex_);
        if (store == store_) return;
        std::swap(store_, store);
        ++state_;
        height_m_.reset();
        place_open_ = place_.has_value();
        for (std::size_t k = 0; k < kRays; ++k) {
            const bool answered_click = k == static_cast<std::size_t>(Ray::click) && !rays_[k].open;
            rays_[k].open = rays_[k].number > 0 && !answered_click;
            hits_[k] = {};
        }
        profile_.open = profile_.count > 0;
        std::swap(answered_profile_, forgotten);
    }
    asked_.notify_all();
}

std::optional<double> GroundProbe::height_m(double x_m, double y_m) {
    const glm::dvec2 place{x_m, y_m};
    if (!finite(place)) return std::nullopt;
    std::optional<double> last;
    {
        const std::lock_guard lock(mutex_);
        last = height_m_;
        if (place_ == place) return last;
        place_ = place;
        place_open_ = true;
    }
    asked_.notify_all();
    return last;
}

std::uint64_t GroundProbe::cast(Ray which, const glm::dvec3& eye, const glm::dvec3& direction, double half_curvature) {
    std::uint64_t number = 0;
    {
        const std::lock_guard lock(mutex_);
        RayQuestion& ray = rays_[static_cast<std::size_t>(which)];
        const bool same =
            ray.number > 0 && ray.eye == eye && ray.direction == direction && ray.half_curvature == half_curvature;
        if (same && which != Ray::click) return ray.number;
        number = ray.number + 1;
        ray = {eye, direction, half_curvature, number, true};
    }
    asked_.notify_all();
    return number;
}

GroundProbe::Hit GroundProbe::last_hit(Ray which) const {
    const std::lock_guard lock(mutex_);
    return hits_[static_cast<std::size_t>(which)];
}

void GroundProbe::profile(const glm::dvec2& from_m, const glm::dvec2& to_m, int count) {
    if (!finite(from_m) || !finite(to_m) || !finite(to_m - from_m)) return;
    {
        const std::lock_guard lock(mutex_);
        profile_ = {from_m, to_m, std::clamp(count, 2, kMostProfilePoints), true};
    }
    asked_.notify_all();
}

std::shared_ptr<const Profile> GroundProbe::last_profile() const {
    const std::lock_guard lock(mutex_);
    return answered_profile_;
}

// The kinds in turn, from the one after the last that was answered.
std::optional<std::size_t> GroundProbe::next_kind(const Work& work) const {
    for (std::size_t k = 1; k <= kKinds; ++k) {
        const std::size_t kind = (work.last_kind + k) % kKinds;
        if (kind < kRays ? rays_[kind].open : kind == kHeight ? place_open_ : profile_.open || work.profile.has_value())
            return kind;
    }
    return std::nullopt;
}

void GroundProbe::run() {
    Work work;
    std::unique_lock lock(mutex_);
    for (;;) {
        asked_.wait(lock, [&] { return stopping_ || next_kind(work); });
        if (stopping_) return;
        const std::size_t kind = *next_kind(work);
        work.last_kind = kind;
        work.state = state_;
        answer(kind, work, lock);
    }
}

void GroundProbe::answer(std::size_t kind, Work& work, std::unique_lock<std::mutex>& lock) {
    if (kind == kHeight)
        answer_height(work, lock);
    else if (kind == kProfile)
        answer_profile(work, lock);
    else
        answer_ray(kind, work, lock);
}

void GroundProbe::answer_height(Work& work, std::unique_lock<std::mutex>& lock) {
    const std::shared_ptr<const TileStore> store = store_;
    const glm::dvec2 place = *place_;
    place_open_ = false;
    lock.unlock();
    const std::optional<double> height_m = height_of(work.open(store), place);
    lock.lock();
    if (work.state != state_) return;
    height_m_ = height_m;
    lock.unlock();
    if (on_answer_) on_answer_();
    lock.lock();
}

void GroundProbe::answer_ray(std::size_t which, Work& work, std::unique_lock<std::mutex>& lock) {
    const std::shared_ptr<const TileStore> store = store_;
    const RayQuestion ray = rays_[which];
    rays_[which].open = false;
    lock.unlock();
    Ground* ground = work.open(store);
    const auto point = answer_or_none([&]() -> std::optional<glm::dvec3> {
        if (ground == nullptr) return {};
        auto hit = cast_curved_ray(*ground, ray.eye, ray.direction, ray.half_curvature);
        return hit ? *hit : std::nullopt;
    });
    lock.lock();
    if (work.state != state_) {
        // A click under way when the store changed.
        if (rays_[which].number == ray.number) rays_[which].open = true;
        return;
    }
    hits_[which] = {ray.number, point};
    lock.unlock();
    if (on_answer_) on_answer_();
    lock.lock();
}

void GroundProbe::answer_profile(Work& work, std::unique_lock<std::mutex>& lock) {
    const std::shared_ptr<const TileStore> store = store_;
    if (profile_.open) {
        work.profile = Profile{profile_.from_m, profile_.to_m, {}};
        work.profile_count = profile_.count;
        profile_.open = false;
    }
    lock.unlock();
    Ground* ground = work.open(store);
    Profile& profile = *work.profile;
    const glm::dvec2 across = profile.to_m - profile.from_m;
    for (int slice = 0; slice < kProfileSlice && std::ssize(profile.points) < work.profile_count; ++slice) {
        const double w = static_cast<double>(profile.points.size()) / (work.profile_count - 1);
        const glm::dvec2 place = w < 1 ? profile.from_m + across * w : profile.to_m;
        profile.points.push_back({std::hypot(across.x, across.y) * w, height_of(ground, place)});
    }
    const bool complete = std::ssize(profile.points) == work.profile_count;
    std::shared_ptr<const Profile> answered;
    if (complete) answered = std::make_shared<const Profile>(std::move(profile));
    if (complete) work.profile.reset();
    lock.lock();
    if (!complete || work.state != state_) return;
    std::swap(answered_profile_, answered);
    lock.unlock();
    answered.reset();
    if (on_answer_) on_answer_();
    lock.lock();
}

}  // namespace scree
