#include "runtime/window/hud_panels.h"

#include <imgui.h>

#include <algorithm>
#include <string>

namespace scree {
namespace {

constexpr int kText = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_AlwaysAutoResize |
                      ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;
constexpr int kPanel = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_AlwaysAutoResize |
                       ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoNav;

float em() { return ImGui::GetFontSize(); }
float margin() { return 0.75f * em(); }

void text(const std::string& words) { ImGui::TextUnformatted(words.data(), words.data() + words.size()); }

void faint_text(const std::string& words) {
    ImGui::PushStyleColor(ImGuiCol_Text, {0.72f, 0.75f, 0.78f, 1});
    text(words);
    ImGui::PopStyleColor();
}

glm::dvec4 place_of_window() {
    const ImVec2 at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
    return {at.x, at.y, at.x + size.x, at.y + size.y};
}

constexpr float kLabel_em = 5.5f, kValue_em = 27;

void rows(const std::vector<HudModel::Row>& all) {
    for (const HudModel::Row& row : all) {
        faint_text(row.label);
        ImGui::SameLine(kLabel_em * em());
        ImGui::PushTextWrapPos((kLabel_em + kValue_em) * em());
        ImGui::TextWrapped("%s", row.value.c_str());
        ImGui::PopTextWrapPos();
    }
}

void bars(const std::vector<HudModel::Bar>& all) {
    ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {0, 0});  // else the bars stand lower than their words
    for (const HudModel::Bar& bar : all) {
        faint_text(bar.label);
        ImGui::SameLine(kLabel_em * em());
        ImGui::ProgressBar(static_cast<float>(bar.share), {6 * em(), em()}, "");
        ImGui::SameLine();
        text(bar.value);
    }
    ImGui::PopStyleVar();
}

// From 0 to what is usual, so that one slow frame does not flatten all others.
void frame_graph(const std::vector<float>& frame_ms) {
    if (frame_ms.empty()) return;
    std::vector<float> sorted = frame_ms;
    std::sort(sorted.begin(), sorted.end());
    const float top = std::max(sorted[sorted.size() * 95 / 100] * 1.25f, 5.0f);
    ImGui::PushStyleColor(ImGuiCol_FrameBg, {0, 0, 0, 0.35f});
    ImGui::PlotLines("##frames", frame_ms.data(), static_cast<int>(frame_ms.size()), 0, nullptr, 0, top,
                     {(kLabel_em + kValue_em) * em(), 2.5f * em()});
    ImGui::PopStyleColor();
}

ImVec4 colour(const std::array<std::uint8_t, 4>& rgba) {
    return {static_cast<float>(rgba[0]) / 255, static_cast<float>(rgba[1]) / 255, static_cast<float>(rgba[2]) / 255,
            static_cast<float>(rgba[3]) / 255};
}

const HudModel::Refusal* refusal_of(const HudModel& model, Action action) {
    for (const HudModel::Refusal& refusal : model.refused)
        if (refusal.action == action) return &refusal;
    return nullptr;
}

constexpr float kKey_em = 6.5f, kMostHelp_em = 32;

void key_line(std::string_view name, std::string_view does, bool greyed, float width) {
    const ImVec4 off = ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled);
    ImGui::PushStyleColor(ImGuiCol_Text, greyed ? off : ImVec4(0.65f, 0.85f, 1, 1));
    text(std::string(name));
    ImGui::PopStyleColor();
    ImGui::SameLine(kKey_em * em());  // from the left of the group
    if (greyed) ImGui::PushStyleColor(ImGuiCol_Text, off);
    ImGui::PushTextWrapPos(ImGui::GetCursorPosX() + width - kKey_em * em());
    ImGui::TextWrapped("%s", std::string(does).c_str());
    ImGui::PopTextWrapPos();
    if (greyed) ImGui::PopStyleColor();
}

// Lines of the list of keys, headings included.
struct HelpLine {
    std::string_view heading, name, does;
    bool greyed = false;
};

std::vector<HelpLine> help_lines(const HudModel& model) {
    std::vector<HelpLine> lines;
    lines.push_back({"Held down", {}, {}});
    for (const HeldBinding& held : held_bindings()) lines.push_back({{}, held.name, held.does});
    std::string_view group;
    for (const KeyBinding& key : key_bindings()) {
        if (key.group != group) lines.push_back({key.group, {}, {}});
        group = key.group;
        lines.push_back({{}, key.name, key.does, refusal_of(model, key.action) != nullptr});
    }
    return lines;
}

// Where the second column begins: the heading that is nearest the middle.
std::size_t second_column(const std::vector<HelpLine>& lines) {
    std::size_t best = lines.size();
    const auto off = [&](std::size_t k) { return k > lines.size() / 2 ? k - lines.size() / 2 : lines.size() / 2 - k; };
    for (std::size_t k = 0; k < lines.size(); ++k)
        if (!lines[k].heading.empty() && off(k) < off(best)) best = k;
    return best;
}

void help_column(std::span<const HelpLine> lines, float width) {
    ImGui::BeginGroup();
    for (const HelpLine& line : lines) {
        if (!line.heading.empty())
            text(std::string(line.heading));
        else
            key_line(line.name, line.does, line.greyed, width);
    }
    ImGui::EndGroup();
}

}  // namespace

void draw_status(const HudModel& model) {
    ImGui::SetNextWindowPos({margin(), margin()});
    ImGui::SetNextWindowBgAlpha(0.62f);
    if (ImGui::Begin("status", nullptr, kText)) {
        text(model.title);
        frame_graph(model.frame_ms);
        rows(model.picture);
        bars(model.memory);
        ImGui::Separator();
        rows(model.place);
    }
    ImGui::End();
}

void draw_legend(const HudModel& model) {
    if (model.legend.empty() && model.signs.empty()) return;
    ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x - margin(), margin()}, ImGuiCond_Always, {1, 0});
    ImGui::SetNextWindowBgAlpha(0.62f);
    if (ImGui::Begin("legend", nullptr, kText)) {
        for (const std::string& sign : model.signs) ImGui::TextColored({1, 0.72f, 0.35f, 1}, "%s", sign.c_str());
        if (!model.legend.empty()) text(model.legend_title);
        for (const HudModel::Swatch& swatch : model.legend) {
            ImGui::ColorButton("##swatch", colour(swatch.rgba),
                               ImGuiColorEditFlags_NoTooltip | ImGuiColorEditFlags_NoDragDrop, {em(), em()});
            ImGui::SameLine();
            text(swatch.text);
        }
    }
    ImGui::End();
}

void draw_credit(const HudModel& model) {
    if (model.credit.empty()) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const float right = size.x * static_cast<float>(1 - model.second_share) - margin();
    ImGui::SetNextWindowPos({right, size.y - margin()}, ImGuiCond_Always, {1, 1});
    ImGui::SetNextWindowBgAlpha(0.4f);
    if (ImGui::Begin("credit", nullptr, kText)) {
        ImGui::PushTextWrapPos(right - 3 * margin());
        ImGui::TextUnformatted(model.credit.c_str());
        ImGui::PopTextWrapPos();
    }
    ImGui::End();
}

void draw_second_frame(const HudModel& model) {
    if (model.second_share <= 0) return;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    const auto left_over = static_cast<float>(1 - model.second_share);
    ImGui::GetBackgroundDrawList()->AddRect({size.x * left_over, size.y * left_over}, {size.x + 1, size.y + 1},
                                            IM_COL32(255, 255, 255, 200));
}

void draw_progress(const HudModel& model) {
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({size.x / 2, size.y - 4 * margin()}, ImGuiCond_Always, {0.5f, 1});
    ImGui::SetNextWindowBgAlpha(0.62f);
    if (ImGui::Begin("progress", nullptr, kText)) {
        text(model.progress->text);
        ImGui::ProgressBar(static_cast<float>(model.progress->share), {20 * em(), 0.6f * em()}, "");
    }
    ImGui::End();
}

void draw_toasts(const HudModel& model, float above) {
    if (model.toasts.empty()) return;
    const float width = ImGui::GetIO().DisplaySize.x;
    ImGui::SetNextWindowPos({margin(), above - margin()}, ImGuiCond_Always, {0, 1});
    ImGui::SetNextWindowBgAlpha(0.75f);
    if (ImGui::Begin("toasts", nullptr, kText)) {
        ImGui::PushTextWrapPos(std::min(width - 4 * margin(), 45 * em()));
        for (const std::string& toast : model.toasts) ImGui::TextWrapped("%s", toast.c_str());
        ImGui::PopTextWrapPos();
    }
    ImGui::End();
}

DrawnPanel draw_help(const HudModel& model) {
    DrawnPanel panel;
    const ImVec2 size = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos({size.x / 2, size.y / 2}, ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::SetNextWindowBgAlpha(0.92f);
    if (ImGui::Begin("keys", nullptr, kPanel)) {
        const std::vector<HelpLine> lines = help_lines(model);
        const std::span<const HelpLine> all(lines);
        const std::size_t half = second_column(lines);
        const float width = std::min((size.x - 8 * margin()) / 2, kMostHelp_em * em());
        help_column(all.first(half), width);
        ImGui::SameLine(0, 2 * margin());
        help_column(all.subspan(half), width);
        if (!model.refused.empty()) ImGui::Separator();
        const std::string* last = nullptr;
        for (const HudModel::Refusal& refusal : model.refused) {
            if (last == nullptr || *last != refusal.why) faint_text(refusal.why);
            last = &refusal.why;
        }
        panel.place = place_of_window();
    }
    ImGui::End();
    return panel;
}

}  // namespace scree
