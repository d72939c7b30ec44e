// A display of its own for a window under test (Xvfb), and what a user does there (xdotool).
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/programs/child_program.h"

namespace scree::test {

class VirtualDisplay {
public:
    /// 800 x 600 pixels. Without Xvfb the name is empty.
    VirtualDisplay();
    ~VirtualDisplay();
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;
    const std::string& name() const { return name_; }

private:
    pid_t child_ = -1;
    std::string name_;
};

struct Picture {
    std::vector<std::uint8_t> rgb;
    std::size_t colours = 0;
};
/// Empty where it cannot be read.
Picture picture_of(const std::string& file);
/// The whole display, by ImageMagick's import.
Picture screenshot(const ProgramOptions& display, const std::string& file);

}  // namespace scree::test
