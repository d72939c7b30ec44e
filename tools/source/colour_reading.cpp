#include "tools/source/colour_reading.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include "tools/source/image_source.h"

namespace scree {
namespace {

constexpr std::int64_t kMaxSamples = std::int64_t{1} << 24;
// So many units of one image at least, where it has them: a few rows of large tiles would see little of it. 16 rows of
// 256-sample tiles of an image 40000 wide are 160 M pixels decoded.
constexpr std::int64_t kLeastUnits = 16;
constexpr std::int64_t kPercent = 2;

struct Image {
    std::string path;
    std::int64_t width = 0, height = 0, unit_rows = 1;
    int bands = 1;
};

// Which pixels of an image are looked at.
struct Spread {
    std::int64_t units = 1, all_units = 1;
    std::int64_t row_step = 1, column_step = 1;  ///< within a unit
};

Result<std::vector<Image>> wide_images(const std::vector<std::string>& paths, const OpenOptions& options) {
    std::vector<Image> images;
    for (const std::string& path : paths) {
        Result<std::unique_ptr<ImageSource>> source = ImageSource::open(path, options);
        if (!source) return source.error();
        const ImageInfo& info = (*source)->info();
        if (!info.eight_bit)
            images.push_back(
                {path, info.width, info.height, std::max<std::int64_t>(info.unit_rows, 1), info.shown_bands});
    }
    return images;
}

double samples_of(const Image& image) {
    return static_cast<double>(image.width) * static_cast<double>(image.height) * image.bands;
}

// `share` of all samples may be taken, of every image alike.
Spread spread_over(const Image& image, double share, std::int64_t images) {
    Spread spread;
    spread.all_units = (image.height + image.unit_rows - 1) / image.unit_rows;
    const auto wanted = static_cast<std::int64_t>(std::ceil(share * static_cast<double>(spread.all_units)));
    spread.units = std::min(spread.all_units, std::max({wanted, kLeastUnits / images, std::int64_t{1}}));
    // How many times too many these units hold.
    const double surplus = static_cast<double>(spread.units) / static_cast<double>(spread.all_units) / share;
    spread.row_step = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::sqrt(surplus)), 1, image.unit_rows);
    spread.column_step = std::max<std::int64_t>(1, std::llround(surplus / static_cast<double>(spread.row_step)));
    return spread;
}

Result<void> take_samples(const Image& image, const Spread& spread, const OpenOptions& options,
                          std::vector<float>& taken) {
    Result<std::unique_ptr<ImageSource>> source = ImageSource::open(image.path, options);
    if (!source) return source.error();
    std::vector<float> line(static_cast<std::size_t>(image.width * image.bands));
    for (std::int64_t i = 0; i < spread.units; ++i) {
        // The middle of the i-th of equal shares of the units.
        const std::int64_t unit = (2 * i + 1) * spread.all_units / (2 * spread.units);
        const std::int64_t end = std::min((unit + 1) * image.unit_rows, image.height);
        for (std::int64_t row = unit * image.unit_rows; row < end; row += spread.row_step) {
            if (Result<void> read = (*source)->read_shown(row, row + 1, line); !read) return read;
            for (std::int64_t column = 0; column < image.width; column += spread.column_step)
                for (std::int64_t band = 0; band < image.bands; ++band) {
                    const float value = line[static_cast<std::size_t>(column * image.bands + band)];
                    if (std::isfinite(value)) taken.push_back(value);
                }
        }
    }
    return {};
}

double percentile(std::vector<float>& values, std::size_t index) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(index);
    std::nth_element(values.begin(), at, values.end());
    return *at;
}

Stretch stretch_of(std::vector<float>& values) {
    Stretch stretch{0, 255, true};
    if (values.empty()) return stretch;  // nothing will be shown
    const std::size_t aside = (values.size() - 1) * kPercent / 100;
    stretch.low = percentile(values, aside);
    stretch.high = percentile(values, values.size() - 1 - aside);
    if (stretch.low == stretch.high) {
        const double half = std::max(1.0, std::abs(stretch.low) * 1e-3);
        stretch = {stretch.low - half, stretch.high + half, true};
    }
    return stretch;
}

}  // namespace

Result<std::optional<Stretch>> choose_stretch(const std::vector<std::string>& paths, const OpenOptions& options) {
    OpenOptions unstretched = options;
    unstretched.colours.stretch.reset();
    Result<std::vector<Image>> images = wide_images(paths, unstretched);
    if (!images) return images.error();
    if (images->empty()) return std::optional<Stretch>();
    double all = 0;
    for (const Image& image : *images) all += samples_of(image);
    const double share = std::min(1.0, static_cast<double>(kMaxSamples) / all);
    std::vector<float> taken;
    for (const Image& image : *images) {
        const Spread spread = spread_over(image, share, static_cast<std::int64_t>(images->size()));
        if (Result<void> read = take_samples(image, spread, unstretched, taken); !read) return read.error();
    }
    return std::optional(stretch_of(taken));
}

}  // namespace scree
