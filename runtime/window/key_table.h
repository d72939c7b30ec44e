// The keys of the window, in one table: what the window does by them, what F1 shows, and what docs/flying.md lists
// (tests/runtime/window compare the two).
#pragma once

#include <span>
#include <string_view>

namespace scree {

enum class Action {
    help,
    quit,
    home,
    orbit,
    walk,
    hud,
    second_view,
    fullscreen,
    wireframe,
    colour_by_level,
    colour_by_geomip,
    colour_by_error,
    boxes,
    freeze,
    finer,
    coarser,
    next_method,
    higher,  ///< exaggeration up
    lower,
    sun_on,  ///< the sun, by an hour
    sun_back,
    screenshot,
    record,
    replay,
    profile
};
inline constexpr int kActions = static_cast<int>(Action::profile) + 1;

struct KeyBinding {
    Action action;
    int key = 0;  ///< GLFW's number
    bool shift = false;
    std::string_view name;   ///< of the key, as it stands on a keyboard: "Shift+X"
    std::string_view group;  ///< heading that it stands under
    std::string_view does;   ///< half a sentence: "wireframe on and off"
};

/// In the order in which they are shown, group after group; one an action.
std::span<const KeyBinding> key_bindings();
/// What a key that went down means; null: nothing. Shift is held for a fast flight too, so a key that has no meaning of
/// its own with it means what it means without.
const KeyBinding* binding_of(int key, bool shift);

/// Keys and buttons that act while they are held, for F1 and the docs: {name, does}.
struct HeldBinding {
    std::string_view name, does;
};
std::span<const HeldBinding> held_bindings();

}  // namespace scree
