#include "runtime/window/toasts.h"

#include <algorithm>

namespace scree {
namespace {

constexpr std::size_t kMost = 4;
// People read about 15 letters a second and need a moment to look.
double seconds_to_read(const std::string& text) { return 2.5 + static_cast<double>(text.size()) / 15; }

}  // namespace

void Toasts::say(std::string text, double now_s) {
    std::erase_if(toasts_, [&](const Toast& toast) { return toast.text == text; });
    if (toasts_.size() == kMost) toasts_.erase(toasts_.begin());
    const double until_s = now_s + seconds_to_read(text);
    toasts_.push_back({std::move(text), until_s});
}

bool Toasts::expire(double now_s) {
    return std::erase_if(toasts_, [&](const Toast& toast) { return toast.until_s <= now_s; }) > 0;
}

std::vector<std::string> Toasts::texts() const {
    std::vector<std::string> texts;
    for (const Toast& toast : toasts_) texts.push_back(toast.text);
    return texts;
}

std::optional<double> Toasts::next_end_s() const {
    const auto first = std::min_element(toasts_.begin(), toasts_.end(),
                                        [](const Toast& a, const Toast& b) { return a.until_s < b.until_s; });
    if (first == toasts_.end()) return std::nullopt;
    return first->until_s;
}

}  // namespace scree
