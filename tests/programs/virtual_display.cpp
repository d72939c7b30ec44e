#include "tests/programs/virtual_display.h"

#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <set>

namespace scree::test {

VirtualDisplay::VirtualDisplay() {
    int pipe_ends[2];
    if (::pipe(pipe_ends) != 0) return;
    child_ = ::fork();
    if (child_ == 0) {
        ::close(pipe_ends[0]);
        const int nothing = ::open("/dev/null", O_RDWR);
        ::dup2(nothing, STDOUT_FILENO);
        ::dup2(nothing, STDERR_FILENO);
        const std::string fd = std::to_string(pipe_ends[1]);
        ::execlp("Xvfb", "Xvfb", "-displayfd", fd.c_str(), "-screen", "0", "800x600x24", "-nolisten", "tcp", nullptr);
        ::_exit(127);
    }
    ::close(pipe_ends[1]);
    char buffer[16] = {};
    std::string number;
    for (ssize_t n; (n = ::read(pipe_ends[0], buffer, sizeof buffer)) > 0 && number.find('\n') == std::string::npos;)
        number.append(buffer, static_cast<std::size_t>(n));
    ::close(pipe_ends[0]);
    if (const std::size_t end = number.find('\n'); end != std::string::npos && end > 0)
        name_ = ":" + number.substr(0, end);
}

VirtualDisplay::~VirtualDisplay() {
    if (child_ <= 0) return;
    ::kill(child_, SIGTERM);
    ::waitpid(child_, nullptr, 0);
}

Picture picture_of(const std::string& file) {
    Picture picture;
    const auto in = OIIO::ImageInput::open(file);
    if (!in) return picture;
    const auto pixels = static_cast<std::size_t>(in->spec().width) * static_cast<std::size_t>(in->spec().height);
    const auto channels = static_cast<std::size_t>(in->spec().nchannels);
    std::vector<std::uint8_t> all(pixels * channels);
    if (!in->read_image(0, 0, 0, in->spec().nchannels, OIIO::TypeDesc::UINT8, all.data())) return picture;
    std::set<std::uint32_t> colours;
    for (std::size_t k = 0; k < pixels; ++k) {
        const std::uint8_t* p = &all[k * channels];
        picture.rgb.insert(picture.rgb.end(), p, p + 3);
        colours.insert(std::uint32_t{p[0]} << 16 | std::uint32_t{p[1]} << 8 | p[2]);
    }
    picture.colours = colours.size();
    return picture;
}

Picture screenshot(const ProgramOptions& display, const std::string& file) {
    if (run_program("import", {"-silent", "-window", "root", file}, display).exit_code != 0) return {};
    return picture_of(file);
}

}  // namespace scree::test
