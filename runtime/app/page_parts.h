// What the pages of a flight and of an audit have alike. Pure.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/result.h"
#include "runtime/report/html.h"
#include "runtime/report/plot.h"

namespace scree {

/// Pictures in a page are no wider, and no more: a page stays under about 3 MB.
inline constexpr int kPictureWidth_px = 420;
inline constexpr std::size_t kPictures = 8;

/// A frame of the flight or audit as it was drawn.
struct PosePicture {
    std::size_t frame = 0;
    PagePicture picture;
};

/// Frames that are pictured, evenly spaced over `frames`, the first and the last among them.
std::vector<std::size_t> pictured_frames(std::size_t frames);

/// The section of pictures; `captions`, HTML, one a picture. Errors: ErrorCode::io (no memory).
Result<std::string> pictures_html(const std::vector<PosePicture>& pictures, const std::vector<std::string>& captions);

/// A chart over frames, 0 to the last: a line for each series, whose values are by frame.
struct FrameSeries {
    std::string name;
    std::vector<double> values;
    bool dashed = false;
};
LineChart frame_chart(const std::string& title, const std::string& what, const std::vector<FrameSeries>& series);

/// Values so far beyond the tolerance that a linear axis would show nothing but them.
bool is_wide(const std::vector<double>& values, double tau_px);

/// "1 hole", "2 holes", "no hole".
std::string counted(std::int64_t count, const std::string& one, const std::string& many);

/// "scree-view fly STORE ...", as main was given it, quoted for a shell.
std::string typed_command(const std::string& command, int argc, const char* const* argv);

/// The section that says how to have the same again; `command` is text.
std::string command_html(const std::string& command);

}  // namespace scree
