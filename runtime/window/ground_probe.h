// GroundProbe: heights and rays against the finest stored ground for a window, on a thread of its own: a frame waits
// neither for a disk nor for a program that commits an update. Questions are kept by kind; a newer one of a kind takes
// the place of one that is not answered yet, and kinds are answered in turn, so that none waits for the questions of
// another.
#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <glm/glm.hpp>

#include "common/store/tile_store.h"

namespace scree {

/// Heights along a straight line on the map.
struct Profile {
    struct Point {
        double along_m = 0;              ///< on the map, from the first end
        std::optional<double> height_m;  ///< none: no ground
    };
    glm::dvec2 from_m{0}, to_m{0};
    std::vector<Point> points;  ///< evenly spaced, both ends included
};

/// A profile's heights are read one after the other: 4096 are more than a window is wide.
inline constexpr int kMostProfilePoints = 4096;

/// The frame-loop thread calls (any thread may); nothing waits but the destructor, for a read that is under way.
/// Answers are the latest that have come, to the question asked last or to one before. An error of the store is no
/// answer: no ground.
class GroundProbe {
public:
    /// `on_answer`: called on the probe's thread when an answer has come (to wake a sleeping window), never after the
    /// destructor has returned; may be empty, may call the probe.
    GroundProbe(std::shared_ptr<const TileStore> store, std::function<void()> on_answer);
    ~GroundProbe();
    GroundProbe(const GroundProbe&) = delete;
    GroundProbe& operator=(const GroundProbe&) = delete;

    /// From now on answers are those of `store`; what was answered before is forgotten, and asked again of it (clicks
    /// apart that had their answer). Nothing happens where it is the store already.
    void use(std::shared_ptr<const TileStore> store);

    /// Asks for the height of the ground at a place, metres in the dataset's CRS, and returns the last answer. The same
    /// place is not asked for twice. No place (NaN): no answer.
    std::optional<double> height_m(double x_m, double y_m);
    /// Which ray an answer is wanted for. Each use has its own: the cursor's, which changes all the time, does not take
    /// the place of a click.
    enum class Ray { cursor, click, middle };
    /// Asks where a ray meets the ground. `half_curvature`: 1 / (2 R), 1/m, of the picture that it was aimed in, round
    /// `eye`; 0: flat. Returns the question's number: casts of this kind, from 1. The same ray as the last of its kind
    /// is the same question, but for clicks.
    std::uint64_t cast(Ray which, const glm::dvec3& eye, const glm::dvec3& direction, double half_curvature);
    struct Hit {
        std::uint64_t question = 0;       ///< the one that this answers; 0: none yet
        std::optional<glm::dvec3> point;  ///< on the flat map; none: no ground there
    };
    Hit last_hit(Ray which) const;
    /// Asks for `count` heights along a line, 2 to kMostProfilePoints (what lies outside is brought there). Heights and
    /// rays are answered meanwhile. Ends that are no places: nothing happens.
    void profile(const glm::dvec2& from_m, const glm::dvec2& to_m, int count);
    /// The last profile that was answered; null: none yet. Stays while held.
    std::shared_ptr<const Profile> last_profile() const;

private:
    struct RayQuestion {
        glm::dvec3 eye{0}, direction{0};
        double half_curvature = 0;
        std::uint64_t number = 0;  ///< 0: never asked
        bool open = false;
    };
    struct ProfileQuestion {
        glm::dvec2 from_m{0}, to_m{0};
        int count = 0;  ///< 0: never asked
        bool open = false;
    };
    static constexpr std::size_t kRays = 3, kHeight = kRays, kProfile = kRays + 1, kKinds = kRays + 2;
    /// The probe's thread alone: the store that it reads, and a profile that it is at.
    struct Work;

    void run();
    std::optional<std::size_t> next_kind(const Work& work) const;
    void answer(std::size_t kind, Work& work, std::unique_lock<std::mutex>& lock);
    void answer_height(Work& work, std::unique_lock<std::mutex>& lock);
    void answer_ray(std::size_t which, Work& work, std::unique_lock<std::mutex>& lock);
    void answer_profile(Work& work, std::unique_lock<std::mutex>& lock);

    const std::function<void()> on_answer_;
    mutable std::mutex mutex_;
    std::condition_variable asked_;
    std::shared_ptr<const TileStore> store_;
    std::uint64_t state_ = 0;  ///< counts stores: answers from one that was left are dropped
    bool stopping_ = false;
    std::optional<glm::dvec2> place_;
    bool place_open_ = false;
    std::optional<double> height_m_;
    std::array<RayQuestion, kRays> rays_;
    std::array<Hit, kRays> hits_;
    ProfileQuestion profile_;
    std::shared_ptr<const Profile> answered_profile_;
    std::thread thread_;
};

}  // namespace scree
