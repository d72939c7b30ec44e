#include "runtime/app/hud_text.h"

#include <fmt/format.h>

#include <cmath>

namespace scree {

std::string grouped(std::int64_t count) {
    const std::string digits = fmt::format("{}", count);
    std::string words;
    for (std::size_t k = 0; k < digits.size(); ++k) {
        const bool group_begins = k > 0 && digits[k - 1] != '-' && (digits.size() - k) % 3 == 0;
        if (group_begins) words.push_back(' ');
        words.push_back(digits[k]);
    }
    return words;
}

std::string length_text(double metres) {
    if (std::abs(metres) < 10) return fmt::format("{:.1f} m", metres);
    if (std::abs(metres) < 10'000) return fmt::format("{:.0f} m", metres);
    return fmt::format("{:.1f} km", metres / 1000);
}

std::string speed_text(double metres_per_s) {
    if (metres_per_s < 10) return fmt::format("{:.1f} m/s", metres_per_s);
    if (metres_per_s < 1000) return fmt::format("{:.0f} m/s", metres_per_s);
    return fmt::format("{:.1f} km/s", metres_per_s / 1000);
}

std::string megabytes(std::int64_t bytes) {
    const double mb = static_cast<double>(bytes) / 1e6;
    return mb < 10 ? fmt::format("{:.1f}", mb) : fmt::format("{:.0f}", mb);
}

std::string place_text(const glm::dvec3& place, const Dataset& dataset) {
    return fmt::format("{:.1f} E, {:.1f} N, {:.1f} m", place.x, place.y, place.z / dataset.exaggeration);
}

std::optional<std::string> lon_lat_text(const glm::dvec3& place, const Dataset& dataset) {
    if (!dataset.geo_grid) return std::nullopt;
    const auto at = dataset.geo_grid->lon_lat(place.x, place.y);
    if (!at) return std::nullopt;
    return fmt::format("{:.5f}\xc2\xb0 {}, {:.5f}\xc2\xb0 {}", std::abs(at->latitude_deg),
                       at->latitude_deg < 0 ? "S" : "N", std::abs(at->longitude_deg),
                       at->longitude_deg < 0 ? "W" : "E");
}

std::string direction_text(const glm::dvec3& direction) {
    constexpr const char* kPoints[] = {"N", "NE", "E", "SE", "S", "SW", "W", "NW"};
    constexpr double kAcross = 1e-3;  // of the length; below, what there is of a heading is rounding
    const double across = std::hypot(direction.x, direction.y);
    if (across <= kAcross * std::abs(direction.z)) return direction.z < 0 ? "straight down" : "straight up";
    const auto pitch = std::lround(glm::degrees(std::atan2(direction.z, across)));
    const auto heading = (std::lround(glm::degrees(std::atan2(direction.x, direction.y))) + 360) % 360;
    const auto point = static_cast<std::size_t>((2 * heading + 45) / 90 % 8);
    const std::string tilt =
        pitch == 0 ? "level" : fmt::format("{}\xc2\xb0 {}", std::abs(pitch), pitch < 0 ? "down" : "up");
    return fmt::format("{}\xc2\xb0 {}, {}", heading, kPoints[point], tilt);
}

std::string hour_text(double hour) {
    const auto minutes = static_cast<int>(std::lround(hour * 60)) % (24 * 60);
    return fmt::format("{}:{:02}", minutes / 60, minutes % 60);
}

HudModel::Bar slots_bar(std::string of, std::int64_t used, std::int64_t slots, std::int64_t bytes_each) {
    return {std::move(of),
            fmt::format("{} of {} tiles, {} of {} MB", grouped(used), grouped(slots), megabytes(used * bytes_each),
                        megabytes(slots * bytes_each)),
            slots > 0 ? static_cast<double>(used) / static_cast<double>(slots) : 0};
}

}  // namespace scree
