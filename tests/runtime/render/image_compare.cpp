#include "tests/runtime/render/image_compare.h"

#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>

#include "runtime/render/png.h"

namespace scree {

Result<Image> load_png(const std::filesystem::path& path) {
    png_image header{};
    header.version = PNG_IMAGE_VERSION;
    const auto fail = [&] {
        Error error{ErrorCode::io, fmt::format("cannot read {}: {}", path.string(), header.message)};
        png_image_free(&header);
        return error;
    };
    if (png_image_begin_read_from_file(&header, path.c_str()) == 0) return fail();
    header.format = PNG_FORMAT_RGB;
    Image image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
    image.rgb.resize(PNG_IMAGE_SIZE(header));
    if (png_image_finish_read(&header, nullptr, image.rgb.data(), 0, nullptr) == 0) return fail();
    return image;
}

ImageDifference compare_images(const Image& golden, const Image& found, const ImageTolerance& tolerance,
                               const std::filesystem::path& difference_path) {
    ImageDifference result;
    if (golden.width_px != found.width_px || golden.height_px != found.height_px) {
        result.share = 1;
        result.message = fmt::format("{}x{} px, golden {}x{} px", found.width_px, found.height_px, golden.width_px,
                                     golden.height_px);
        return result;
    }
    Image shown = golden;
    std::size_t differing = 0;
    for (std::size_t k = 0; k < golden.rgb.size(); k += 3) {
        int difference = 0, sum = 0;
        for (std::size_t c = k; c < k + 3; ++c) {
            difference = std::max(difference, std::abs(golden.rgb[c] - found.rgb[c]));
            sum += golden.rgb[c];
        }
        result.largest = std::max(result.largest, difference);
        const bool differs = difference > tolerance.per_channel;
        differing += differs ? 1 : 0;
        const auto grey = static_cast<std::uint8_t>(sum / 6);
        for (std::size_t c = k; c < k + 3; ++c) shown.rgb[c] = !differs ? grey : c == k ? 255 : 0;
    }
    result.share = static_cast<double>(differing) / (static_cast<double>(golden.rgb.size()) / 3);
    result.same = result.share <= tolerance.differing_share;
    result.message = fmt::format("{} pixels ({:.4f} %) differ by more than {}, the largest by {}", differing,
                                 100 * result.share, tolerance.per_channel, result.largest);
    if (!result.same && !difference_path.empty()) {
        const auto written = write_png(difference_path, shown.width_px, shown.height_px, shown.rgb);
        result.message += written ? fmt::format("; see {}", difference_path.string()) : "; " + written.error().message;
    }
    return result;
}

}  // namespace scree
