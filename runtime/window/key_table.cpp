#include "runtime/window/key_table.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <array>

namespace scree {
namespace {

constexpr std::string_view kMoving = "Moving", kShowing = "Showing", kAccuracy = "Accuracy", kMeasuring = "Measuring",
                           kWindow = "Window";

constexpr std::array kBindings{
    KeyBinding{Action::home, GLFW_KEY_HOME, false, "Home", kMoving, "back to where the flight began"},
    KeyBinding{Action::orbit, GLFW_KEY_O, false, "O", kMoving, "circle round a point, and fly again"},
    KeyBinding{Action::walk, GLFW_KEY_G, false, "G", kMoving, "walk on the ground, and fly again"},
    KeyBinding{Action::record, GLFW_KEY_F9, false, "F9", kMoving, "record the flight; again to stop and write it"},
    KeyBinding{Action::replay, GLFW_KEY_F10, false, "F10", kMoving, "fly the recorded flight again; again to stop"},

    KeyBinding{Action::wireframe, GLFW_KEY_F, false, "F", kShowing, "wireframe on and off"},
    KeyBinding{Action::colour_by_level, GLFW_KEY_1, false, "1", kShowing, "colour by level on and off"},
    KeyBinding{Action::colour_by_geomip, GLFW_KEY_2, false, "2", kShowing, "colour by geomip level on and off"},
    KeyBinding{Action::colour_by_error, GLFW_KEY_3, false, "3", kShowing, "colour by error on and off"},
    KeyBinding{Action::boxes, GLFW_KEY_B, false, "B", kShowing, "boxes of the tiles drawn on and off"},
    KeyBinding{Action::freeze, GLFW_KEY_Z, false, "Z", kShowing,
               "freeze what is drawn, to fly round it and its frustum; again to go on"},
    KeyBinding{Action::second_view, GLFW_KEY_V, false, "V", kShowing, "second view from above on and off"},
    KeyBinding{Action::higher, GLFW_KEY_X, false, "X", kShowing, "exaggerate heights more"},
    KeyBinding{Action::lower, GLFW_KEY_X, true, "Shift+X", kShowing, "exaggerate heights less"},
    KeyBinding{Action::sun_on, GLFW_KEY_U, false, "U", kShowing, "the sun an hour on"},
    KeyBinding{Action::sun_back, GLFW_KEY_U, true, "Shift+U", kShowing, "the sun an hour back"},

    KeyBinding{Action::finer, GLFW_KEY_RIGHT_BRACKET, false, "]", kAccuracy, "finer, by a fifth of the tolerance"},
    KeyBinding{Action::coarser, GLFW_KEY_LEFT_BRACKET, false, "[", kAccuracy, "coarser, by a quarter of the tolerance"},
    KeyBinding{Action::next_method, GLFW_KEY_M, false, "M", kAccuracy, "the next method of choosing triangles"},

    KeyBinding{Action::profile, GLFW_KEY_P, false, "P", kMeasuring,
               "heights along a line: click both of its ends; again to leave"},

    KeyBinding{Action::help, GLFW_KEY_F1, false, "F1", kWindow, "these keys on and off"},
    KeyBinding{Action::hud, GLFW_KEY_H, false, "H", kWindow, "figures on and off"},
    KeyBinding{Action::fullscreen, GLFW_KEY_F11, false, "F11", kWindow, "the whole screen on and off"},
    KeyBinding{Action::screenshot, GLFW_KEY_F12, false, "F12", kWindow, "write the picture to a PNG file"},
    KeyBinding{Action::quit, GLFW_KEY_ESCAPE, false, "Esc", kWindow, "close what is open on top, then the window"}};

constexpr std::array kHeld{HeldBinding{"W A S D", "fly ahead, left, back, right; walk; move the point that is circled"},
                           HeldBinding{"Q E", "down, up"},
                           HeldBinding{"Arrows", "look left, right, up, down"},
                           HeldBinding{"Shift", "four times as fast"},
                           HeldBinding{"Left drag", "look round; circle"},
                           HeldBinding{"Right drag", "move along the ground"},
                           HeldBinding{"Wheel", "faster or slower; nearer or farther while circling"},
                           HeldBinding{"Left click", "glide to the point under the cursor"}};

}  // namespace

std::span<const KeyBinding> key_bindings() { return kBindings; }
std::span<const HeldBinding> held_bindings() { return kHeld; }

const KeyBinding* binding_of(int key, bool shift) {
    const KeyBinding* without = nullptr;
    for (const KeyBinding& binding : kBindings) {
        if (binding.key != key) continue;
        if (binding.shift == shift) return &binding;
        if (!binding.shift) without = &binding;
    }
    return without;
}

}  // namespace scree
