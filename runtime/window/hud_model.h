// HudModel: what stands over the picture of a window, as plain text and numbers; and what a user does to it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/window/ground_probe.h"
#include "runtime/window/key_table.h"

namespace scree {

struct HudModel {
    struct Row {
        std::string label, value;
    };
    struct Bar {
        std::string label, value;
        double share = 0;  ///< 0..1
    };
    struct Swatch {
        std::array<std::uint8_t, 4> rgba{255, 255, 255, 255};
        std::string text;
    };
    struct Progress {
        double share = 0;  ///< 0..1
        std::string text;
    };
    struct Refusal {
        Action action;
        std::string why;
    };
    struct ProfilePanel {
        std::shared_ptr<const Profile> heights;  ///< null: not there yet
        std::string summary;
    };

    bool show_status = true, show_help = false;
    std::string title;
    std::vector<float> frame_ms;  ///< oldest first
    std::vector<Row> picture;     ///< of what is drawn
    std::vector<Bar> memory;
    std::vector<Row> place;  ///< where the eye and the cursor are
    std::string legend_title;
    std::vector<Swatch> legend;        ///< empty: none
    std::vector<std::string> signs;    ///< what is on and must not be forgotten: "recording"
    std::vector<std::string> toasts;   ///< oldest first
    std::string credit;                ///< attribution
    double second_share = 0;           ///< of the window's width and height that the second view fills; 0: none
    std::optional<Progress> progress;  ///< of the first picture
    std::optional<ProfilePanel> profile;
    std::vector<Refusal> refused;  ///< greyed in the list of keys
};

/// What a user did to the panels of the last frame.
struct HudAnswer {
    std::optional<std::size_t> profile_point;  ///< pointed at
    bool save_profile = false, close_profile = false;
};

}  // namespace scree
