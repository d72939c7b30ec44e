// ProfileTool: a height profile between two places that a user clicks on: what is asked for, what the panel shows, what
// is drawn on the terrain. Pure but for the file.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/glm.hpp>

#include "common/dataset.h"
#include "common/result.h"
#include "runtime/render/line_renderer.h"
#include "runtime/window/ground_probe.h"
#include "runtime/window/hud_model.h"

namespace scree {

/// What a profile says in short. Heights in metres as the ground has them.
struct ProfileSummary {
    double length_m = 0;
    std::optional<double> low_m, high_m;  ///< none: no ground along it
    double ascent_m = 0, descent_m = 0;   ///< summed over neighbouring points that both have ground
};
/// `exaggeration`: of the profile's heights.
ProfileSummary summary_of(const Profile& profile, double exaggeration);
/// "along_m,x_m,y_m,height_m,longitude_deg,latitude_deg,crs", a line a point: x, y and height in the dataset's systems,
/// the height as the ground has it. Empty where there is no ground, or the dataset does not say.
std::string csv_of(const Profile& profile, const Dataset& dataset);

class ProfileTool {
public:
    static constexpr int kPoints = 512;

    bool on() const { return on_; }
    void start();
    void stop() { *this = {}; }
    /// The next end, on the drawn ground. Both ends, once there are two: ask for the profile.
    std::optional<std::array<glm::dvec2, 2>> add_end(const glm::dvec3& place);
    std::optional<std::array<glm::dvec2, 2>> ends() const;
    /// What the probe has answered. True: it is the answer that was waited for.
    bool take(std::shared_ptr<const Profile> answered);
    const Profile* profile() const { return profile_.get(); }
    /// True: the mark on the terrain moves.
    bool point_at(std::optional<std::size_t> point);

    HudModel::ProfilePanel panel(double exaggeration) const;
    /// The course on a flat world, lifted off the ground by a little, and marks at its ends and where it is pointed at,
    /// as high as shows from `eye`.
    std::vector<LineSegment> lines(const glm::dvec3& eye) const;

private:
    std::vector<LineSegment> course(const glm::dvec3& eye) const;

    bool on_ = false;
    std::vector<glm::dvec3> ends_;
    std::shared_ptr<const Profile> profile_;
    std::optional<std::size_t> pointed_at_;
};

}  // namespace scree
