#include "runtime/app/page_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

namespace scree {
namespace {

/// Points of a line: more than its pixels show nothing.
constexpr std::size_t kMostPoints = 1000;
/// Lines of few frames show where each stands.
constexpr std::size_t kMostMarked = 40;

}  // namespace

std::vector<std::size_t> pictured_frames(std::size_t frames) {
    std::vector<std::size_t> chosen;
    const std::size_t count = std::min(frames, kPictures);
    for (std::size_t k = 0; k < count; ++k)
        chosen.push_back(count == 1 ? 0 : (k * (frames - 1) + (count - 1) / 2) / (count - 1));
    return chosen;
}

Result<std::string> pictures_html(const std::vector<PosePicture>& pictures, const std::vector<std::string>& captions) {
    assert(pictures.size() == captions.size());
    std::string html = "<div class=\"pictures along\">\n";
    for (std::size_t k = 0; k < pictures.size(); ++k) {
        auto image = image_html(pictures[k].picture, fmt::format("frame {}", pictures[k].frame));
        if (!image) return image;
        html += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", *image, captions[k]);
    }
    return html + "</div>\n";
}

LineChart frame_chart(const std::string& title, const std::string& what, const std::vector<FrameSeries>& series) {
    LineChart chart;
    chart.title = title;
    chart.x.label = "frame";
    chart.y.label = what;
    std::size_t frames = 0;
    for (const FrameSeries& s : series) {
        frames = std::max(frames, s.values.size());
        std::vector<std::pair<double, double>> points;
        for (std::size_t k = 0; k < s.values.size(); ++k) points.emplace_back(static_cast<double>(k), s.values[k]);
        chart.series.push_back({s.name, thinned(points, kMostPoints), true, points.size() <= kMostMarked, s.dashed});
    }
    chart.x.range = std::pair{0.0, std::max(1.0, static_cast<double>(frames) - 1)};
    return chart;
}

bool is_wide(const std::vector<double>& values, double tau_px) {
    return std::any_of(values.begin(), values.end(), [&](double v) { return tau_px > 0 && v > 4 * tau_px; });
}

std::string counted(std::int64_t count, const std::string& one, const std::string& many) {
    if (count == 0) return "no " + one;
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

std::string typed_command(const std::string& command, int argc, const char* const* argv) {
    std::string line = "scree-view " + command;
    for (int k = 1; k < argc; ++k) line += " " + shell_quoted(argv[k]);
    return line;
}

std::string command_html(const std::string& command) {
    return fmt::format("<h2>The same again</h2>\n<p><code>{}</code></p>\n", escaped(command));
}

}  // namespace scree
