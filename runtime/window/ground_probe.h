// GroundProbe: heights and rays against the finest stored ground for a window, on a thread of its own: a frame waits
// neither for a disk nor for a program that commits an update. Questions are kept by kind; a newer one of a kind takes
// the place of one that is not answered yet.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include <glm/glm.hpp>

#include "common/store/sqlite_store.h"

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

/// The frame-loop thread calls; nothing waits. Answers are the latest that have come, to the question asked last or to
/// one before.
class GroundProbe {
public:
    /// `on_answer`: called on the probe's thread when an answer has come (to wake a sleeping window); may be empty.
    GroundProbe(std::shared_ptr<const SqliteStore> store, std::function<void()> on_answer);
    ~GroundProbe();
    GroundProbe(const GroundProbe&) = delete;
    GroundProbe& operator=(const GroundProbe&) = delete;

    /// From now on answers are those of `store`; what was answered before is forgotten.
    void use(std::shared_ptr<const SqliteStore> store);

    /// Asks for the height of the ground at a place, metres in the dataset's CRS, and returns the last answer.
    std::optional<double> height_m(double x_m, double y_m);
    /// Which ray an answer is wanted for. Each use has its own: the cursor's, which changes all the time, does not take
    /// the place of a click.
    enum class Ray { cursor, click, middle };
    /// Asks where a ray meets the ground. `half_curvature`: 1 / (2 R), 1/m, of the picture that it was aimed in, round
    /// `eye`; 0: flat.
    void cast(Ray which, const glm::dvec3& eye, const glm::dvec3& direction, double half_curvature);
    struct Hit {
        std::uint64_t question = 0;       ///< counts the casts of this kind, from 1
        std::optional<glm::dvec3> point;  ///< on the flat map; none: no ground there
    };
    Hit last_hit(Ray which) const;
    /// Asks for `count` heights along a line.
    void profile(const glm::dvec2& from_m, const glm::dvec2& to_m, int count);
    /// The last profile that was answered; null: none yet. Stays while held.
    std::shared_ptr<const Profile> last_profile() const;
};

}  // namespace scree
