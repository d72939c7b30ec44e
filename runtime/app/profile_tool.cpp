#include "runtime/app/profile_tool.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/crs_label.h"
#include "runtime/app/stage_lines.h"

namespace scree {
namespace {

constexpr Rgba kCourse{255, 210, 90, 255}, kMark{255, 120, 60, 255};
// Of the distance from the eye, so that they look the same from anywhere.
constexpr double kLift = 0.002, kEndHeight = 0.04, kMarkHeight = 0.12;

std::string metres(double length_m) {
    return length_m < 10'000 ? fmt::format("{:.0f} m", length_m) : fmt::format("{:.1f} km", length_m / 1000);
}

std::string words_of(const ProfileSummary& s) {
    if (!s.low_m) return fmt::format("{} long, no ground along it", metres(s.length_m));
    return fmt::format("{} long   lowest {:.1f} m   highest {:.1f} m   up {:.0f} m   down {:.0f} m", metres(s.length_m),
                       *s.low_m, *s.high_m, s.ascent_m, s.descent_m);
}

glm::dvec2 place_of(const Profile& profile, std::size_t k) {
    const double share = static_cast<double>(k) / static_cast<double>(profile.points.size() - 1);
    return glm::mix(profile.from_m, profile.to_m, share);
}

}  // namespace

ProfileSummary summary_of(const Profile& profile, double exaggeration) {
    ProfileSummary s;
    s.length_m = glm::length(profile.to_m - profile.from_m);
    std::optional<double> before_m;
    for (const Profile::Point& point : profile.points) {
        std::optional<double> here_m;
        if (point.height_m) here_m = *point.height_m / exaggeration;
        if (here_m) {
            s.low_m = std::min(s.low_m.value_or(*here_m), *here_m);
            s.high_m = std::max(s.high_m.value_or(*here_m), *here_m);
        }
        if (here_m && before_m) {
            s.ascent_m += std::max(*here_m - *before_m, 0.0);
            s.descent_m += std::max(*before_m - *here_m, 0.0);
        }
        before_m = here_m;
    }
    return s;
}

std::string csv_of(const Profile& profile, const Dataset& dataset) {
    std::string crs = crs_code_or_name(dataset);
    std::replace(crs.begin(), crs.end(), ',', ' ');  // a name, and a column of its own
    std::string csv = "along_m,x_m,y_m,height_m,longitude_deg,latitude_deg,crs\n";
    for (std::size_t k = 0; k < profile.points.size(); ++k) {
        const Profile::Point& point = profile.points[k];
        const glm::dvec2 at = profile.points.size() > 1 ? place_of(profile, k) : profile.from_m;
        const auto on_earth = dataset.geo_grid ? dataset.geo_grid->lon_lat(at.x, at.y) : std::nullopt;
        csv += fmt::format(
            "{:.3f},{:.3f},{:.3f},{},{},{}\n", point.along_m, at.x, at.y,
            point.height_m ? fmt::format("{:.3f}", *point.height_m / dataset.exaggeration) : "",
            on_earth ? fmt::format("{:.7f},{:.7f}", on_earth->longitude_deg, on_earth->latitude_deg) : ",", crs);
    }
    return csv;
}

void ProfileTool::start() {
    stop();
    on_ = true;
}

std::optional<std::array<glm::dvec2, 2>> ProfileTool::add_end(const glm::dvec3& place) {
    if (ends_.size() == 2) {
        start();  // another one
    }
    ends_.push_back(place);
    return ends();
}

std::optional<std::array<glm::dvec2, 2>> ProfileTool::ends() const {
    if (ends_.size() < 2) return std::nullopt;
    return std::array{glm::dvec2(ends_[0]), glm::dvec2(ends_[1])};
}

bool ProfileTool::take(std::shared_ptr<const Profile> answered) {
    if (!answered || answered == profile_ || ends_.size() < 2) return false;
    if (answered->from_m != glm::dvec2(ends_[0]) || answered->to_m != glm::dvec2(ends_[1])) return false;
    profile_ = std::move(answered);
    return true;
}

bool ProfileTool::point_at(std::optional<std::size_t> point) {
    if (point == pointed_at_) return false;
    pointed_at_ = point;
    return true;
}

HudModel::ProfilePanel ProfileTool::panel(double exaggeration) const {
    if (ends_.empty()) return {nullptr, "Height profile: click where it begins."};
    if (ends_.size() == 1) return {nullptr, "Height profile: click where it ends."};
    if (!profile_) return {nullptr, "Height profile: reading the ground ..."};
    auto shown = std::make_shared<Profile>(*profile_);
    for (Profile::Point& point : shown->points)
        if (point.height_m) *point.height_m /= exaggeration;
    return {shown, words_of(summary_of(*shown, 1))};
}

std::vector<LineSegment> ProfileTool::course(const glm::dvec3& eye) const {
    std::vector<LineSegment> lines;
    const Profile& p = *profile_;
    const auto lifted = [&](std::size_t k) {
        const glm::dvec3 on_ground(place_of(p, k), *p.points[k].height_m);
        return on_ground + glm::dvec3(0, 0, kLift * glm::length(on_ground - eye));
    };
    for (std::size_t k = 1; k < p.points.size(); ++k)
        if (p.points[k - 1].height_m && p.points[k].height_m) lines.push_back({lifted(k - 1), lifted(k), kCourse});
    return lines;
}

std::vector<LineSegment> ProfileTool::lines(const glm::dvec3& eye) const {
    std::vector<LineSegment> lines;
    const auto mark = [&](const glm::dvec3& foot, double height, const Rgba& rgba) {
        lines.push_back({foot, foot + glm::dvec3(0, 0, height * glm::length(foot - eye)), rgba});
    };
    if (profile_) lines = course(eye);
    for (const glm::dvec3& end : ends_) mark(end, kEndHeight, kCourse);
    if (profile_ && pointed_at_ && *pointed_at_ < profile_->points.size()) {
        const auto& height_m = profile_->points[*pointed_at_].height_m;
        mark({place_of(*profile_, *pointed_at_), height_m.value_or(ends_[0].z)}, kMarkHeight, kMark);
    }
    return lines;
}

}  // namespace scree
