// Toasts: messages that a window shows for a while. Pure; no clock of its own.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace scree {

class Toasts {
public:
    /// The same text again only lasts longer.
    void say(std::string text, double now_s);
    /// Lets go of what is over. True: something was.
    bool expire(double now_s);
    std::vector<std::string> texts() const;
    /// When the next one is over, if there is one.
    std::optional<double> next_end_s() const;

private:
    struct Toast {
        std::string text;
        double until_s = 0;
    };
    std::vector<Toast> toasts_;  ///< oldest first
};

}  // namespace scree
