#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "runtime/window/hud_panels.h"

namespace scree {
namespace {

constexpr int kFlags = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                       ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;
constexpr ImU32 kGround = IM_COL32(150, 125, 90, 200), kLine = IM_COL32(245, 225, 180, 255),
                kAxis = IM_COL32(255, 255, 255, 60), kMarker = IM_COL32(255, 120, 60, 255);

struct Range {
    double low = 0, high = 1;
};

Range heights_of(const Profile& profile) {
    Range range{1e300, -1e300};
    for (const Profile::Point& point : profile.points) {
        if (!point.height_m) continue;
        range = {std::min(range.low, *point.height_m), std::max(range.high, *point.height_m)};
    }
    if (range.low > range.high) return {};
    const double air = std::max(0.08 * (range.high - range.low), 0.5);
    return {range.low - air, range.high + air};
}

// Where heights stand on the panel.
struct Plot {
    ImVec2 low, high;  // left top, right bottom
    Range range;
    std::size_t points = 0;

    float x(std::size_t k) const {
        return low.x + (high.x - low.x) * static_cast<float>(k) / static_cast<float>(points - 1);
    }
    float y(double height_m) const {
        return high.y - static_cast<float>((height_m - range.low) / (range.high - range.low)) * (high.y - low.y);
    }
};

void draw_ground(ImDrawList& on, const Plot& plot, const Profile& profile) {
    const ImDrawListFlags smooth = on.Flags;
    on.Flags &= ~ImDrawListFlags_AntiAliasedFill;  // neighbours would show seams
    for (std::size_t k = 1; k < profile.points.size(); ++k) {
        const auto &a = profile.points[k - 1].height_m, &b = profile.points[k].height_m;
        if (!a || !b) continue;
        const ImVec2 left{plot.x(k - 1), plot.y(*a)}, right{plot.x(k), plot.y(*b)};
        on.AddQuadFilled({left.x, plot.high.y}, left, right, {right.x, plot.high.y}, kGround);
        on.AddLine(left, right, kLine, 1.5f);
    }
    on.Flags = smooth;
}

// Three lines at round heights.
void draw_scale(ImDrawList& on, const Plot& plot) {
    const double raw = (plot.range.high - plot.range.low) / 3;
    const double decade = std::pow(10, std::floor(std::log10(raw)));
    const double step = raw / decade >= 5 ? 5 * decade : raw / decade >= 2 ? 2 * decade : decade;
    for (double at = std::ceil(plot.range.low / step) * step; at <= plot.range.high; at += step) {
        on.AddLine({plot.low.x, plot.y(at)}, {plot.high.x, plot.y(at)}, kAxis);
        char label[32];
        const int length = std::snprintf(label, sizeof label, "%.*f m", step < 1 ? 1 : 0, at);
        if (plot.y(at) - ImGui::GetFontSize() > plot.low.y)
            on.AddText({plot.low.x + 4, plot.y(at) - ImGui::GetFontSize()}, IM_COL32(255, 255, 255, 170), label,
                       label + length);
    }
}

std::optional<std::size_t> pointed_at(const Plot& plot) {
    if (!ImGui::IsItemHovered() || plot.points < 2) return std::nullopt;
    const float share = (ImGui::GetIO().MousePos.x - plot.low.x) / (plot.high.x - plot.low.x);
    const float k = std::clamp(share, 0.0f, 1.0f) * static_cast<float>(plot.points - 1);
    return static_cast<std::size_t>(std::lround(k));
}

void draw_marker(ImDrawList& on, const Plot& plot, const Profile& profile, std::size_t k) {
    on.AddLine({plot.x(k), plot.low.y}, {plot.x(k), plot.high.y}, kMarker);
    const auto& height_m = profile.points[k].height_m;
    if (height_m) on.AddCircleFilled({plot.x(k), plot.y(*height_m)}, 3, kMarker);
    if (height_m)
        ImGui::SetTooltip("%.0f m along: %.1f m", profile.points[k].along_m, *height_m);
    else
        ImGui::SetTooltip("%.0f m along: no ground", profile.points[k].along_m);
}

std::optional<std::size_t> plot_of(const Profile& profile) {
    const ImVec2 room = ImGui::GetContentRegionAvail(), at = ImGui::GetCursorScreenPos();
    ImGui::InvisibleButton("plot", {std::max(room.x, 1.0f), std::max(room.y, 1.0f)});
    if (profile.points.size() < 2) return std::nullopt;
    const Plot plot{at, {at.x + room.x, at.y + room.y}, heights_of(profile), profile.points.size()};
    ImDrawList& on = *ImGui::GetWindowDrawList();
    draw_ground(on, plot, profile);
    draw_scale(on, plot);
    const auto pointed = pointed_at(plot);
    if (pointed) draw_marker(on, plot, profile, *pointed);
    return pointed;
}

}  // namespace

DrawnPanel draw_profile(const HudModel::ProfilePanel& profile) {
    DrawnPanel panel;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    // No higher than its words until there are heights: the ground behind it is there to be clicked.
    const float words = ImGui::GetFrameHeight() + 2 * ImGui::GetStyle().WindowPadding.y;
    const float em = ImGui::GetFontSize(), height = profile.heights ? std::min(13 * em, 0.4f * size.y) : words;
    ImGui::SetNextWindowPos({0.75f * em, size.y - 0.75f * em}, ImGuiCond_Always, {0, 1});
    ImGui::SetNextWindowSize({size.x - 1.5f * em, height});
    ImGui::SetNextWindowBgAlpha(0.8f);
    if (ImGui::Begin("profile", nullptr, kFlags)) {
        ImGui::AlignTextToFramePadding();
        ImGui::TextUnformatted(profile.summary.c_str());
        if (profile.heights) {
            ImGui::SameLine(ImGui::GetWindowWidth() - 11 * em);
            panel.answer.save_profile = ImGui::Button("Save CSV");
            ImGui::SameLine();
            panel.answer.close_profile = ImGui::Button("Close");
            panel.answer.profile_point = plot_of(*profile.heights);
        }
        const ImVec2 at = ImGui::GetWindowPos(), extent = ImGui::GetWindowSize();
        panel.place = {at.x, at.y, at.x + extent.x, at.y + extent.y};
    }
    ImGui::End();
    return panel;
}

}  // namespace scree
